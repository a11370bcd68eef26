# OpenVDB with what its headers and its use need: TBB, Boost's headers, Imath (or the older Half).
find_path(OpenVDB_INCLUDE_DIR openvdb/openvdb.h)
find_path(OpenVDB_TBB_INCLUDE_DIR tbb/parallel_for.h)
find_path(OpenVDB_BOOST_INCLUDE_DIR boost/numeric/conversion/conversion_traits.hpp)
find_library(OpenVDB_LIBRARY openvdb)
find_library(OpenVDB_TBB_LIBRARY tbb)
find_library(OpenVDB_HALF_LIBRARY NAMES Imath Imath-3_1 Half)
mark_as_advanced(OpenVDB_INCLUDE_DIR OpenVDB_TBB_INCLUDE_DIR OpenVDB_BOOST_INCLUDE_DIR OpenVDB_LIBRARY OpenVDB_TBB_LIBRARY
                 OpenVDB_HALF_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenVDB REQUIRED_VARS OpenVDB_LIBRARY OpenVDB_INCLUDE_DIR OpenVDB_TBB_LIBRARY
                                  OpenVDB_TBB_INCLUDE_DIR OpenVDB_BOOST_INCLUDE_DIR OpenVDB_HALF_LIBRARY)
if(OpenVDB_FOUND AND NOT TARGET OpenVDB::openvdb)
  add_library(OpenVDB::openvdb INTERFACE IMPORTED)
  target_include_directories(OpenVDB::openvdb INTERFACE ${OpenVDB_INCLUDE_DIR} ${OpenVDB_TBB_INCLUDE_DIR}
                                                        ${OpenVDB_BOOST_INCLUDE_DIR})
  target_link_libraries(OpenVDB::openvdb INTERFACE ${OpenVDB_LIBRARY} ${OpenVDB_TBB_LIBRARY} ${OpenVDB_HALF_LIBRARY})
endif()
