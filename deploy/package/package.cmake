# What lies in the .deb, and what CPack says of it; included where PANELGATE_PACKAGE is set, which is
# what deploy/package.sh does. It sets PANELGATE_ARCHITECTURE (of Debian), PANELGATE_DEPENDS,
# PANELGATE_DOCUMENTS (the packed man pages and changelogs) and SOURCE_DATE_EPOCH.
set(HERE ${CMAKE_CURRENT_LIST_DIR})
set(DEPLOY ${PROJECT_SOURCE_DIR}/deploy)
set(CONFIG ${PROJECT_SOURCE_DIR}/config)
set(DOC share/doc/panelgate)

install(FILES ${DEPLOY}/systemd/panelgate.service DESTINATION /lib/systemd/system)
install(FILES ${DEPLOY}/udev/60-panelgate.rules DESTINATION /lib/udev/rules.d)
# postinst copies the demonstration to /etc/panelgate/panelgate.yaml, once. A configuration is never that of
# the package, so an upgrade has nothing to ask about it.
install(FILES ${CONFIG}/demo.yaml DESTINATION share/panelgate)
install(DIRECTORY ${CONFIG}/profiles DESTINATION share/panelgate FILES_MATCHING PATTERN *.yaml)
install(FILES ${CONFIG}/minimal.yaml ${CONFIG}/panelgate.example.yaml ${CONFIG}/demo.yaml
        DESTINATION ${DOC}/examples)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${DOC})
install(FILES ${PANELGATE_DOCUMENTS}/sbom.cdx.json DESTINATION share/panelgate)
install(DIRECTORY ${DEPLOY}/prometheus ${DEPLOY}/grafana DESTINATION ${DOC}/examples)
install(FILES ${HERE}/copyright DESTINATION ${DOC})
install(FILES ${PANELGATE_DOCUMENTS}/panelgate.bash DESTINATION share/bash-completion/completions
        RENAME panelgate)
install(FILES ${PANELGATE_DOCUMENTS}/panelgate.zsh DESTINATION share/zsh/vendor-completions
        RENAME _panelgate)
install(FILES ${PANELGATE_DOCUMENTS}/panelgate.fish DESTINATION share/fish/vendor_completions.d)
install(FILES ${PANELGATE_DOCUMENTS}/changelog.gz ${PANELGATE_DOCUMENTS}/changelog.Debian.gz
        DESTINATION ${DOC})
install(FILES ${PANELGATE_DOCUMENTS}/panelgate.1.gz DESTINATION share/man/man1)
install(FILES ${PANELGATE_DOCUMENTS}/panelgate.yaml.5.gz DESTINATION share/man/man5)

set(CPACK_GENERATOR DEB)
set(CPACK_SET_DESTDIR ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_NAME panelgate)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The panelgate authors <panelgate@plant.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Modbus RTU-to-TCP gateway for operator panels on RS-485 lines")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Serves the stations of RS-485 lines, operator panels of several vendors
among them, to Modbus/TCP clients, to REST and to Prometheus: many clients
at once, never a value that was not asked for, no write that is repeated,
and a dashboard that explains each frame on the line.

/etc/panelgate/panelgate.yaml is a demonstration on simulated panels, on
the loopback interface only, until a plant's own takes its place.")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${PANELGATE_ARCHITECTURE})
set(CPACK_DEBIAN_PACKAGE_SECTION net)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "${PANELGATE_DEPENDS}, adduser")
set(CPACK_DEBIAN_PACKAGE_PREDEPENDS "init-system-helpers (>= 1.54~)")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "prometheus")
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${HERE}/postinst ${HERE}/prerm ${HERE}/postrm)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)
set(CPACK_PRE_BUILD_SCRIPTS ${HERE}/same_times.cmake)
include(CPack)
