# The libraries for WebAssembly, where web/wasm/build-dependencies put them.
set(prefix ${MARROW_WEB_LIBRARIES})

add_library(hwy::hwy INTERFACE IMPORTED GLOBAL)
# There is one target, so there is nothing to choose at run time and nothing to link.
target_compile_definitions(hwy::hwy INTERFACE HWY_COMPILE_ONLY_STATIC)
add_library(TBB::tbb INTERFACE IMPORTED GLOBAL)  # src/base/parallel_pool.h takes its place
add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED GLOBAL)

# imported(NAME ARCHIVES...): archives of the prefix.
function(imported name)
  add_library(${name} INTERFACE IMPORTED GLOBAL)
  list(TRANSFORM ARGN PREPEND ${prefix}/lib/lib)
  list(TRANSFORM ARGN APPEND .a)
  target_link_libraries(${name} INTERFACE ${ARGN})
endfunction()
imported(fmt::fmt fmt)
imported(ZLIB::ZLIB z)
imported(LibArchive::LibArchive archive z)

# The decoders of images are the same for one thread and for several.
set(prefix ${MARROW_WEB_LIBRARIES}/../codecs)
imported(codecs ijg dcmtkcharls openjp2 tiff png turbojpeg)
target_link_libraries(codecs INTERFACE ZLIB::ZLIB)
