# A Debian package: `cpack --config build/release/CPackConfig.cmake`, or deploy/make-package.
# It depends on what deploy/packages/run.txt lists, which is what deploy/install-packages installs.
file(STRINGS ${PROJECT_SOURCE_DIR}/deploy/packages/run.txt lines REGEX "^[a-z]")
set(depends)
foreach(line IN LISTS lines)
  string(REGEX MATCH "^[^ #]+" package "${line}")
  list(APPEND depends ${package})
endforeach()
list(JOIN depends ", " depends)
# A list that changes changes the package.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/deploy/packages/run.txt)

# Bill of materials: each package of Debian that is needed to build and to run, with the version of this machine.
install(CODE "set(lists \"${PROJECT_SOURCE_DIR}/deploy/packages/run.txt;${PROJECT_SOURCE_DIR}/deploy/packages/build.txt\")
set(program \"treeroll ${PROJECT_VERSION}\")
set(bill \"${CMAKE_INSTALL_DOCDIR}/bill-of-materials.txt\")")
install(CODE [[
  set(text "${program}: package, version, what for\nuPlot 1.6.32 (in the programs): curves of the page\n")
  foreach(list IN LISTS lists)
    file(STRINGS ${list} lines REGEX "^[a-z]")
    foreach(line IN LISTS lines)
      string(REGEX MATCH "^([^ #]+) *# *(.*)$" matched "${line}")
      execute_process(COMMAND dpkg-query --show --showformat=\${Version} ${CMAKE_MATCH_1}
        OUTPUT_VARIABLE version ERROR_QUIET RESULT_VARIABLE status)
      if(NOT status EQUAL 0)
        set(version "unknown")
      endif()
      string(APPEND text "${CMAKE_MATCH_1} ${version}: ${CMAKE_MATCH_2}\n")
    endforeach()
  endforeach()
  file(WRITE "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/${bill}" "${text}")
]])

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME treeroll)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "treeroll")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Policy search for robots over LCM: learner, workers and tools")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "libc6, libstdc++6, ${depends}")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "liblcm-bin, liblcm-java, libjchart2d-java, default-jre, python3")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  ${CMAKE_CURRENT_SOURCE_DIR}/postinst ${CMAKE_CURRENT_SOURCE_DIR}/prerm ${CMAKE_CURRENT_SOURCE_DIR}/postrm)
include(CPack)
