# `cmake --install build/release --prefix /usr/local`: programs, libraries, the C header with its pkg-config file, man
# pages, the systemd unit, udev rules, and the settings that ship (share/fovea).
include(GNUInstallDirs)

install(TARGETS fovead fovea fovea-view RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS fovea_client LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS fovea_layer LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})   # `fovea layer run` looks for it there
# The programs find their library wherever the prefix is.
set_target_properties(fovea-view PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
install(FILES protocol/include/fovea/fovea.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/fovea)
install(FILES docs/fovea.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES docs/fovead.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
install(FILES configs/udev/60-fovea.rules DESTINATION lib/udev/rules.d)
install(FILES configs/fovead.toml DESTINATION ${CMAKE_INSTALL_DATADIR}/fovea)
install(DIRECTORY configs/devices configs/layer configs/scenarios configs/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/fovea)

# These two name the prefix, which --prefix may still change.
install(CODE "set(libdir \"${CMAKE_INSTALL_LIBDIR}\")\nset(version \"${PROJECT_VERSION}\")\nset(source \"${PROJECT_SOURCE_DIR}\")")
install(CODE [[
  set(root "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}")
  file(READ "${source}/configs/systemd/fovead.service" unit)
  string(REPLACE "/usr/bin/" "${CMAKE_INSTALL_PREFIX}/bin/" unit "${unit}")
  file(WRITE "${root}/lib/systemd/system/fovead.service" "${unit}")
  file(WRITE "${root}/${libdir}/pkgconfig/fovea.pc"
    "prefix=${CMAKE_INSTALL_PREFIX}\nName: fovea\nDescription: focal points for VR apps, from fovead\nVersion: ${version}\n"
    "Cflags: -I\${prefix}/include\nLibs: -L\${prefix}/${libdir} -lfovea\n")
]])
