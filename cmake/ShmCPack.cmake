# CPack settings that differ between the Debian packages and the .tar.gz archive. cpack reads this
# file once for each generator, i.e. for each kind of output.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package sets its own summary
if(CPACK_GENERATOR STREQUAL "TGZ")
  set(CPACK_COMPONENTS_ALL archive)
  set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENT_INCLUDE_TOPLEVEL_DIRECTORY ON)
  set(CPACK_STRIP_FILES OFF) # packaging/bundle already strips the files
endif()
