# gart_synth: the capture that `gart synth` makes, a library of its own so that the tests can call it. Embree is
# optional: without it the command says what to install.
if(NOT TARGET gart_synth)
  add_library(gart_synth STATIC ${CMAKE_CURRENT_LIST_DIR}/synth_capture.cpp ${CMAKE_CURRENT_LIST_DIR}/synth_scene.cpp
                                ${CMAKE_CURRENT_LIST_DIR}/synth_trace.cpp)
  target_include_directories(gart_synth PUBLIC ${CMAKE_CURRENT_LIST_DIR}/..)
  find_package(Threads REQUIRED)
  target_link_libraries(gart_synth PUBLIC gart::gart gart::io Threads::Threads PRIVATE gart_private_flags)
  if(NOT GART_EMBREE STREQUAL "OFF")
    find_package(embree QUIET)
    if(embree_FOUND)
      target_link_libraries(gart_synth PRIVATE embree)
      target_compile_definitions(gart_synth PRIVATE GART_SYNTH_EMBREE_MAJOR=${embree_VERSION_MAJOR})
    endif()
  endif()
endif()
