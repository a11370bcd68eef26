# Libwebsockets::Libwebsockets, by header and library: its own CMake files ask for event loops that gart does not use.
find_path(Libwebsockets_INCLUDE_DIR libwebsockets.h)
find_library(Libwebsockets_LIBRARY websockets)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Libwebsockets
  REQUIRED_VARS Libwebsockets_LIBRARY Libwebsockets_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "install it: libwebsockets-dev on Debian and Ubuntu")
if(Libwebsockets_FOUND AND NOT TARGET Libwebsockets::Libwebsockets)
  add_library(Libwebsockets::Libwebsockets UNKNOWN IMPORTED)
  set_target_properties(Libwebsockets::Libwebsockets PROPERTIES
    IMPORTED_LOCATION ${Libwebsockets_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${Libwebsockets_INCLUDE_DIR})
endif()
mark_as_advanced(Libwebsockets_INCLUDE_DIR Libwebsockets_LIBRARY)
