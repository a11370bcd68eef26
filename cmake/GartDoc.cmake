# gart_doc: pages of the public names in BUILD/doc/html, made by Doxygen from the comments in the headers. A name without
# a comment is an error. Where there is no Doxygen there is no such target.
find_package(Doxygen 1.9.4 QUIET)
if(DOXYGEN_FOUND)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(gart_doc COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
                    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} COMMENT "Pages of the public names in doc/html" VERBATIM)
endif()
