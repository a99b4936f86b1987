# A thin front over CMake and scripts/.
PRESET ?= release
JOBS ?= $(shell nproc)

.PHONY: all build test tsan demo bench scaling paper viewer fuzz install deps
all: build

deps:
	scripts/install-dependencies

build: deps
	cmake --preset $(PRESET) -Wno-dev --log-level=WARNING
	cmake --build --preset $(PRESET) -j $(JOBS)

test: build
	scripts/test $(PRESET)

# Under ThreadSanitizer; PRESET=asan runs all tests under AddressSanitizer and UBSan.
tsan:
	scripts/install-dependencies tsan
	scripts/tsan

demo: build
	scripts/demo build/$(PRESET)/bin/marrow

# Each target searches for SECONDS, from the seeds and what was found before.
SECONDS ?= 60
fuzz:
	scripts/install-dependencies fuzz
	scripts/fuzz $(SECONDS)

bench: build
	. scripts/test-data; build/$(PRESET)/bin/marrow-bench
	. scripts/test-data; scripts/bench-scikit-image build/$(PRESET)/bin/marrow-bench

scaling: build
	scripts/scaling build/$(PRESET)/bin

paper: build
	scripts/paper build/$(PRESET)/bin/marrow-paper

viewer: build
	build/$(PRESET)/bin/marrow-viewer

install: build
	cmake --install build/$(PRESET)
