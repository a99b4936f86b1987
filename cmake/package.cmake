# Debian packages, by CPack: `make package`.
#
# libmarrowX.Y, libmarrow-dev and marrow; marrow-viewer, marrow-terrain, python3-marrow and marrow-vtk where they are built. GDAL is large, so
# marrow::terrain, library and all, stays in marrow-terrain.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "Marrow")
set(CPACK_PACKAGE_CONTACT "Marrow <marrow@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})

set(CPACK_COMPONENTS_ALL library development program)
if(MARROW_VIEWER)
  list(APPEND CPACK_COMPONENTS_ALL viewer)
endif()
if(MARROW_TERRAIN)
  list(APPEND CPACK_COMPONENTS_ALL terrain)
endif()
if(MARROW_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
if(MARROW_VTK)
  list(APPEND CPACK_COMPONENTS_ALL vtk)
endif()

# debian_package(COMPONENT NAME SECTION CONTENTS [DEPENDS...]): one package; the dependencies beside the shared libraries'.
macro(debian_package component name section contents)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "This package holds ${contents}.
Marrow turns CT and MRI scans into triangle meshes by marching cubes
over a histogram pyramid. It is for research use only and not a medical
device.")
  string(REPLACE ";" ", " depends "${ARGN}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}")
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} RENAME copyright
    COMPONENT ${component})
endmacro()
set(library libmarrow${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(exactly "(= ${PROJECT_VERSION})")
debian_package(library ${library} libs "the shared libraries")
debian_package(development libmarrow-dev libdevel "headers and CMake files"
  "${library} ${exactly}")
debian_package(program marrow science "the command line" "${library} ${exactly}")
debian_package(viewer marrow-viewer science "the desktop viewer" "${library} ${exactly}")
debian_package(terrain marrow-terrain science "the command 'marrow terrain' and its library"
  "${library} ${exactly}" "marrow ${exactly}")
# The modules are for one minor version of Python.
if(MARROW_PYTHON)
  math(EXPR next "${Python_VERSION_MINOR} + 1")
  debian_package(python python3-marrow python "the Python package marrow" "${library} ${exactly}"
    "python3 (>= 3.${Python_VERSION_MINOR})" "python3 (<< 3.${next})" python3-numpy)
endif()
if(MARROW_VTK)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  debian_package(vtk marrow-vtk science "vtkMarrowContour, a filter of VTK, for C++ and Python" "${library} ${exactly}"
    "python3 (>= 3.${Python3_VERSION_MINOR})" "python3 (<< 3.${next})" python3-vtk9)
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS marrow)  # python3 -m marrow runs the program
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
  ${PROJECT_SOURCE_DIR}/packaging/debian/postinst ${PROJECT_SOURCE_DIR}/packaging/debian/prerm)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "marrow-viewer, marrow-terrain")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS vulkan-icd)  # a driver, which marrow::gpu loads where there is one
include(CPack)
