# cmake --install: headers, the libraries that were built, the program, the licence, and the package that
# find_package(gart COMPONENTS ...) reads. A component is a library with its own export file, so that a consumer of
# gart::cpu needs neither Embree nor the CUDA toolkit.
include(CMakePackageConfigHelpers)
set(_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gart)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/gart DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.hpp" PATTERN "*.cuh")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(TARGET gart_program)
  install(TARGETS gart_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

# What a consumer has to find before it can link a library: target -> arguments of find_dependency.
set(_package_of_glm::glm "glm")
set(_package_of_OpenMP::OpenMP_CXX "OpenMP COMPONENTS CXX")
set(_package_of_Threads::Threads "Threads")
set(_package_of_PNG::PNG "PNG")
set(_package_of_TurboJPEG::TurboJPEG "TurboJPEG")
set(_package_of_ZLIB::ZLIB "ZLIB")
set(_package_of_ZSTD::ZSTD "ZSTD")
set(_package_of_WebP::WebP "WebP")
set(_package_of_embree "embree")
set(_package_of_MPI::MPI_CXX "MPI COMPONENTS CXX")
set(_package_of_NCCL::NCCL "NCCL")
set(_package_of_CUDA::cudart "CUDAToolkit")
set(_package_of_CUDA::cudart_static "CUDAToolkit")

set(_components)
set(_config_components)
foreach(component IN ITEMS headers io runtime reference cpu embree distributed cuda optix nccl view all)
  set(target gart_${component})
  set(exported_name ${component})
  if(component STREQUAL "headers")
    set(target gart)
    set(exported_name gart)
  endif()
  if(NOT TARGET ${target})
    continue()
  endif()
  list(APPEND _components ${component})

  get_target_property(libraries ${target} INTERFACE_LINK_LIBRARIES)
  set(packages)
  set(needs)
  foreach(library IN LISTS libraries)
    if(NOT library OR library MATCHES "BUILD_INTERFACE")
      continue()
    endif()
    # $<LINK_ONLY:x> is what a static library links privately, $<$<...>:x> what it links for one language.
    string(REGEX REPLACE ">+$" "" name "${library}")
    string(REGEX MATCH "[A-Za-z0-9_.+-]+(::[A-Za-z0-9_.+-]+)?$" name "${name}")
    if(TARGET ${name})
      get_target_property(aliased ${name} ALIASED_TARGET)
      if(aliased)
        set(name ${aliased})
      endif()
    endif()
    if(name STREQUAL "gart")
      list(APPEND needs headers)
    elseif(name MATCHES "^gart_(io|runtime|view|reference|cpu|embree|distributed|cuda|optix|nccl)$")
      list(APPEND needs ${CMAKE_MATCH_1})
    elseif(DEFINED _package_of_${name})
      list(APPEND packages "${_package_of_${name}}")
    elseif(TARGET ${name} OR name MATCHES "::")
      message(FATAL_ERROR "cmake/GartInstall.cmake: ${target} links ${name}, which no package is known to provide: add it "
                          "to the table there, or link $<BUILD_INTERFACE:${name}> where consumers do not need it")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${exported_name})
  if(GART_SANITIZE AND NOT component MATCHES "headers|all")
    target_link_options(${target} INTERFACE $<INSTALL_INTERFACE:-fsanitize=address,undefined>)
  endif()

  install(TARGETS ${target} EXPORT gart_${component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT gart_${component} FILE gart-${component}.cmake NAMESPACE gart:: DESTINATION ${_package_dir})

  list(REMOVE_DUPLICATES packages)
  list(REMOVE_DUPLICATES needs)
  string(APPEND _config_components "set(_gart_${component}_needs ${needs})\n")
  set(calls)
  foreach(package IN LISTS packages)
    string(APPEND calls " \"${package}\"")
  endforeach()
  string(APPEND _config_components "set(_gart_${component}_packages${calls})\n")
endforeach()
string(REPLACE ";" " " GART_COMPONENTS "${_components}")
set(GART_COMPONENT_FACTS "${_config_components}")

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/gartConfig.cmake.in ${PROJECT_BINARY_DIR}/gartConfig.cmake
                              INSTALL_DESTINATION ${_package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/gartConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/gartConfig.cmake ${PROJECT_BINARY_DIR}/gartConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/src/io/FindTurboJPEG.cmake ${PROJECT_SOURCE_DIR}/src/io/FindZSTD.cmake
              ${PROJECT_SOURCE_DIR}/src/io/FindWebP.cmake
              ${PROJECT_SOURCE_DIR}/backends/distributed/FindNCCL.cmake
        DESTINATION ${_package_dir})
