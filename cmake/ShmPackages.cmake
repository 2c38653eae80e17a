# Debian packages and a binary archive (decision 0072). If SHM_PACKAGES is ON, cpack divides the
# installed files into four Debian packages. It also creates an archive that can be unpacked and
# used in any folder. If SHM_PACKAGES is OFF, there are only two install components: `library`
# contains the whole library, and `tool` contains the tool.

# Install component of the files that programs need at run time if they are linked to the C
# interface.
set(SHM_RUNTIME_COMPONENT library)
set(SHM_ZSH_FOLDER zsh/site-functions)
if(SHM_PACKAGES)
  if(NOT SHM_BUILD_SHARED OR NOT SHM_BUILD_TOOL)
    message(FATAL_ERROR "SHM_PACKAGES needs SHM_BUILD_SHARED and SHM_BUILD_TOOL")
  endif()
  set(SHM_RUNTIME_COMPONENT runtime)
  set(SHM_ZSH_FOLDER zsh/vendor-completions)
  # If the prefix is /usr, GNUInstallDirs selects the folders that Debian uses.
  set(CMAKE_INSTALL_PREFIX /usr)
  set(CMAKE_INSTALL_DOCDIR share/doc/libshmformat-dev)
  add_compile_options("-ffile-prefix-map=${PROJECT_SOURCE_DIR}=." -fstack-protector-strong
                      -D_FORTIFY_SOURCE=2)
  add_link_options(LINKER:-z,relro,-z,now)
endif()

# shm_package(COMPONENT PACKAGE SECTION SUMMARY DESCRIPTION): defines the Debian package PACKAGE,
# which contains the files of COMPONENT.
macro(shm_package component package section summary description)
  set(folder "${CMAKE_INSTALL_DATADIR}/doc/${package}")
  install(FILES "${PROJECT_BINARY_DIR}/debian/copyright" DESTINATION "${folder}" COMPONENT ${component})
  install(FILES "${PROJECT_BINARY_DIR}/debian/changelog" DESTINATION "${folder}"
          RENAME changelog.Debian COMPONENT ${component})
  install(FILES "${PROJECT_SOURCE_DIR}/CHANGELOG.md" DESTINATION "${folder}" RENAME changelog
          COMPONENT ${component})
  install(CODE "file(GLOB files \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man*/*.?\"
                     \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${folder}/changelog*\")
                list(FILTER files EXCLUDE REGEX \"\\\\.gz\$\")
                execute_process(COMMAND gzip -9nf \${files} COMMAND_ERROR_IS_FATAL ANY)"
          COMPONENT ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${description}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
endmacro()

# shm_loaded_packages(RESULT): stores in RESULT the names of the Debian packages, separated by ", ",
# whose libraries the tool opens at run time.
function(shm_loaded_packages result)
  get_property(libraries GLOBAL PROPERTY SHM_LOADED_LIBRARIES)
  set(packages "")
  foreach(library IN LISTS libraries)
    # Search for both paths, because dpkg may list a file under the path that it had before Debian
    # moved /lib into /usr.
    string(REGEX REPLACE "^/usr/" "/" older "${library}")
    execute_process(COMMAND dpkg-query -S "/usr${older}" "${older}" OUTPUT_VARIABLE found ERROR_QUIET)
    if(NOT found MATCHES "^([^:]+):")
      message(FATAL_ERROR "no Debian package contains ${library}")
    endif()
    list(APPEND packages "${CMAKE_MATCH_1}")
  endforeach()
  list(REMOVE_DUPLICATES packages)
  list(JOIN packages ", " packages)
  set(${result} "${packages}" PARENT_SCOPE)
endfunction()

# Configures the packages and includes CPack. This must be the last call in CMakeLists.txt.
macro(shm_packages)
  set(CPACK_PACKAGE_CONTACT "libshmformat authors <authors@shmformat.invalid>"
      CACHE STRING "Contact address of the packages")
  # Revision of our packages. It is lower than -1, the first revision of an official Debian package,
  # so that an official package would replace ours.
  set(CPACK_DEBIAN_PACKAGE_RELEASE 0.1)
  set(SHM_DEBIAN_VERSION "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")
  string(TIMESTAMP SHM_DEBIAN_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)
  file(READ "${PROJECT_SOURCE_DIR}/LICENSE" SHM_LICENSE)
  string(REGEX REPLACE "^.*\n\n(Redistribution)" "\\1" SHM_LICENSE "${SHM_LICENSE}")
  string(STRIP "${SHM_LICENSE}" SHM_LICENSE)
  string(REPLACE "\n" "\n " SHM_LICENSE "${SHM_LICENSE}")
  string(REPLACE "\n \n" "\n .\n" SHM_LICENSE "${SHM_LICENSE}")
  foreach(file copyright changelog)
    configure_file("packaging/debian/${file}.in" "debian/${file}" @ONLY)
  endforeach()

  set(about "Files with the suffix .shm store hexahedral meshes with their data
arrays, time steps and sets, several times smaller, without loss or within
requested error bounds.")
  shm_package(runtime libshmformat-c1 libs "compressed hexahedral meshes, the C interface" "${about}
.
This package has the shared library for programs that use the C interface.")
  shm_package(library libshmformat-dev libdevel "compressed hexahedral meshes, for development" "${about}
.
This package has the headers of the C++ library and of its C interface, the
static C++ library, the specification of the format and the documents.")
  shm_package(tool shmformat-tools science "compressed hexahedral meshes, the tool shm" "${about}
.
This package has the tool shm, which compresses and decompresses Exodus II,
VTK, Gmsh and AVS UCD files, and verifies, compares, repairs, joins, splits
and draws them. It also lets desktops and file(1) recognize .shm files.")
  shm_package(python python3-shmformat python "compressed hexahedral meshes, for Python" "${about}
.
This package has the Python module shmformat, which reads .shm files into
NumPy arrays and writes them, and plugins for meshio and VTK.")

  set(CPACK_PACKAGE_NAME shmformat)
  set(CPACK_PACKAGE_VENDOR "libshmformat authors")
  set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
  set(CPACK_PACKAGE_CHECKSUM SHA256)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
      OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  string(TOLOWER "${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}" platform)
  set(CPACK_PACKAGE_FILE_NAME "shmformat-${PROJECT_VERSION}-${platform}")
  set(CPACK_ARCHIVE_ARCHIVE_FILE_NAME "${CPACK_PACKAGE_FILE_NAME}")
  set(CPACK_PROJECT_CONFIG_FILE "${PROJECT_SOURCE_DIR}/cmake/ShmCPack.cmake")
  set(CPACK_GENERATOR DEB TGZ)

  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_SOURCE shmformat)
  set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
  set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
  set(same "(= ${SHM_DEBIAN_VERSION})")
  set(debian "${PROJECT_SOURCE_DIR}/packaging/debian")

  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA "${debian}/runtime/triggers")
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
  set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS
      "libshmformat-c1 ${same}, libzstd-dev, libxxhash-dev, pkg-config")
  set(CPACK_DEBIAN_TOOL_PACKAGE_SHLIBDEPS ON)
  # CPack does not detect the libraries that the tool opens at run time. The tool's package
  # therefore lists them: it depends on the libraries for file formats, and suggests the library for
  # pictures.
  shm_loaded_packages(CPACK_DEBIAN_TOOL_PACKAGE_DEPENDS)
  set(CPACK_DEBIAN_TOOL_PACKAGE_SUGGESTS librsvg2-2)
  set(CPACK_DEBIAN_TOOL_PACKAGE_CONTROL_EXTRA "${debian}/tools/postinst;${debian}/tools/postrm;${debian}/tools/triggers")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "libshmformat-c1 ${same}, python3 (>= 3.9), python3-cffi (>= 1.15), python3-numpy (>= 1:1.20)")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-fsspec, python3-meshio")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS python3-vtk9)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${debian}/python/postinst;${debian}/python/prerm")

  shm_python_package()
  shm_archive()
  include(CPack)
endmacro()

# Installs the Python modules, the C header that they parse, and the metadata that setup.py
# generates. The package libshmformat-c1 contains the C library that they need.
function(shm_python_package)
  set(python "${PROJECT_SOURCE_DIR}/bindings/python")
  set(folder lib/python3/dist-packages)
  set(files FILES_MATCHING PATTERN "*.py" PATTERN py.typed PATTERN __pycache__ EXCLUDE)
  install(DIRECTORY "${python}/shmformat" DESTINATION ${folder} COMPONENT python ${files})
  install(FILES "${python}/shmformat_paraview.py" DESTINATION ${folder} COMPONENT python)
  install(FILES "${PROJECT_SOURCE_DIR}/bindings/c/include/shmformat.h" DESTINATION ${folder}/shmformat
          COMPONENT python)
  find_program(SHM_DEBIAN_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
  mark_as_advanced(SHM_DEBIAN_PYTHON)
  set(about "shmformat-${PROJECT_VERSION}.dist-info")
  add_custom_command(
    OUTPUT "${about}"
    COMMAND "${CMAKE_COMMAND}" -E env PYTHONDONTWRITEBYTECODE=1 "${SHM_DEBIAN_PYTHON}" -W ignore
            setup.py -q dist_info --output-dir "${CMAKE_CURRENT_BINARY_DIR}"
    WORKING_DIRECTORY "${python}"
    DEPENDS "${python}/setup.py" "${python}/pyproject.toml")
  add_custom_target(shm_python_package ALL DEPENDS "${about}")
  install(DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/${about}" DESTINATION ${folder} COMPONENT python)

  install(DIRECTORY "${python}/shmformat" DESTINATION lib/python COMPONENT archive EXCLUDE_FROM_ALL ${files})
  install(FILES "${python}/shmformat_paraview.py" DESTINATION lib/python COMPONENT archive EXCLUDE_FROM_ALL)
  install(FILES "${PROJECT_SOURCE_DIR}/bindings/c/include/shmformat.h" DESTINATION lib/python/shmformat
          COMPONENT archive EXCLUDE_FROM_ALL)
endfunction()

# Defines the contents of the archive. It includes all shared libraries that the tool needs, for
# users who cannot install packages.
function(shm_archive)
  set(into COMPONENT archive EXCLUDE_FROM_ALL)
  install(PROGRAMS "$<TARGET_FILE:shm>" DESTINATION bin ${into})
  install(FILES "$<TARGET_FILE:shmformat_c>" DESTINATION lib
          RENAME "$<TARGET_SONAME_FILE_NAME:shmformat_c>" ${into})
  install(FILES "${PROJECT_SOURCE_DIR}/bindings/c/include/shmformat.h" DESTINATION include ${into})
  install(DIRECTORY "${PROJECT_BINARY_DIR}/converters/tool/man1" DESTINATION share/man ${into})
  install(FILES "${PROJECT_SOURCE_DIR}/packaging/shm.5" DESTINATION share/man/man5 ${into})
  install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/CHANGELOG.md"
                "${PROJECT_SOURCE_DIR}/packaging/ARCHIVE.md"
          DESTINATION share/doc/shmformat ${into})
  get_property(loaded GLOBAL PROPERTY SHM_LOADED_LIBRARIES)
  install(CODE "execute_process(COMMAND \"${PROJECT_SOURCE_DIR}/packaging/bundle\"
                                        \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\" ${loaded}
                                COMMAND_ERROR_IS_FATAL ANY)"
          ${into})
endfunction()
