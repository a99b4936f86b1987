# A thin front over CMake and scripts/. Each target installs the Debian packages that it needs.
#
# Programs are built in build/release. The developer preset adds the tests and the other front ends to the same folder, so
# that nothing is compiled twice.
JOBS ?= $(shell nproc)
PRESET ?= developer
BUILD := build/$(if $(filter developer,$(PRESET)),release,$(PRESET))
BIN := build/release/bin
PYTHON ?= /usr/bin/python3

configure = cmake --preset $(1) -Wno-dev --log-level=WARNING > /dev/null
build = cmake --build --preset $(1) -j $(JOBS)
install = scripts/install-dependencies

.PHONY: all program demo test install package docs viewer terrain python core tests everything test-paraview web test-web web-serve bench bench-gpu scaling paper accuracy fuzz tsan clang
all: program

program:
	$(install) program gpu
	$(call configure,release)
	$(call build,release) --target marrow

demo:
	$(install) program gpu demo
	$(call configure,release)
	$(call build,release) --target marrow
	scripts/demo $(BIN)/marrow

viewer:
	$(install) program gpu viewer
	$(call configure,release) -D MARROW_VIEWER=ON
	$(call build,release) --target marrow marrow_viewer_program
	$(BIN)/marrow-viewer

terrain:
	$(install) program gpu terrain
	$(call configure,release) -D MARROW_TERRAIN=ON
	$(call build,release) --target marrow marrow_terrain_program

# The Python package, as a wheel in build/wheels: build/release/python holds it too.
python:
	$(install) program gpu python
	$(call configure,release) -D MARROW_PYTHON=ON -D Python_EXECUTABLE=$(PYTHON)
	$(call build,release) --target marrow marrow_python_package
	$(PYTHON) -m pip wheel . --quiet --no-index --no-build-isolation --no-deps --wheel-dir build/wheels \
	  --config-settings build-dir=build/release
	ls build/wheels/*.whl

# For browsers: the npm package, in build/web/marrow-wasm, and the page, in build/web/page.
web:
	$(install) web
	JOBS=$(JOBS) web/build build/web
	npm --prefix web/page ci --loglevel=error --no-audit --no-fund
	npm --prefix web/page run --silent build

test-web: web program
	node --test web/marrow-wasm/test/
	npm --prefix web/page test --silent

# Serves the page on this computer.
web-serve: web
	npm --prefix web/page run --silent serve

# marrow::core alone, with Highway and oneTBB.
core:
	$(install) core
	$(call configure,core)
	$(call build,core)

# In /usr/local, which needs root; run `ldconfig` afterwards, so that programs find the libraries.
install: program
	$(call build,release)
	cmake --install build/release

# Debian packages of the libraries and of all programs, in build/package/packages.
package:
	$(install) program gpu viewer terrain python vtk package
	$(call configure,package)
	$(call build,package)
	cd build/package && cpack > /dev/null
	ls build/package/packages/*.deb

# The reference of the library as a web site, in build/docs/html.
docs:
	$(install) docs
	mkdir -p build/docs
	MARROW_VERSION=$$(sed -n 's/^#define MARROW_VERSION "\(.*\)"/\1/p' include/marrow/version.h) doxygen docs/Doxyfile

# Everything but the benchmarks.
tests:
	$(install) program viewer terrain python gpu tests
	$(call configure,$(PRESET))
	$(call build,$(PRESET))

everything: tests
	$(call build,$(PRESET)) --target benchmarks

test: tests
	$(install) demo
	scripts/install-gltf-validator $(BUILD)/gltf-validator
	scripts/test $(BUILD)

# The plugin of ParaView, which is unpacked in build/paraview and not installed.
test-paraview:
	$(install) core paraview
	$(call configure,core)
	$(call build,core)
	scripts/install-paraview build/paraview/root
	scripts/test-paraview build/paraview/root build/core build/paraview

# What is shipped, by clang, under sanitizers that watch over damaged files. Warnings are errors, in the tests too.
clang:
	$(install) program viewer terrain python gpu tests clang
	scripts/clang $(JOBS)

# The tests that use threads, under ThreadSanitizer. `make test PRESET=asan` runs all tests under AddressSanitizer and UBSan.
tsan:
	$(install) program viewer terrain python gpu tests tsan
	scripts/tsan

# Each fuzz target searches for SECONDS, starting from the seeds and from what was found before.
SECONDS ?= 60
fuzz:
	$(install) program viewer terrain python gpu tests clang
	scripts/fuzz $(SECONDS)

bench: everything
	$(install) bench
	. scripts/test-data; $(BIN)/marrow-bench
	. scripts/test-data; scripts/bench-scikit-image $(BIN)/marrow-bench

# On device number DEVICE of `marrow::gpu::devices()`, as JSON.
DEVICE ?= 0
bench-gpu: everything
	$(BIN)/marrow-bench-gpu --device $(DEVICE)

scaling: everything
	scripts/scaling $(BIN)

paper: everything
	scripts/paper $(BIN)/marrow-paper

# The tables and the picture of docs/accuracy.md, from phantoms of known size.
accuracy: everything
	scripts/accuracy $(BIN)/marrow-accuracy
