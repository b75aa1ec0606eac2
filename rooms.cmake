# Rooms and what each may use: a room's own folder of links is all that its sources see of ours, so that a wrong include does not compile. Of another room they
# see one header, ROOM/ROOM.h, and what that includes. tests/tools/arrows has the same table and tries each arrow.
set(ROOMS base geom solver recon input sim study render cli bench)
set(ROOM_base)
set(ROOM_geom base)
set(ROOM_solver base geom)
set(ROOM_recon base geom)
set(ROOM_input base)
set(ROOM_sim base geom solver recon input)
set(ROOM_study base geom input recon sim)
set(ROOM_render base geom recon input sim)
set(ROOM_cli base geom solver recon input sim study render)
# bench measures the parts of all rooms and looks into them, as the tests do

# what libseldinger.so is made of
set(LIBRARY_ROOMS base geom solver recon input sim)

# What other rooms see of `room`: its header, and the text that includes kernels. Behind them, where only these headers find it, lies the rest.
function(publish_room room)
  set(front ${CMAKE_BINARY_DIR}/rooms/public/${room})
  set(behind ${front}/${room})
  file(MAKE_DIRECTORY ${behind})
  foreach(name ${room}.h each_simd.inc)
    if(EXISTS ${CMAKE_SOURCE_DIR}/${room}/${name})
      file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${room}/${name} ${front}/${name} SYMBOLIC)
    endif()
  endforeach()
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR}/${room} ${CMAKE_SOURCE_DIR}/${room}/*.h)
  foreach(header ${headers})
    get_filename_component(folder ${behind}/${header} DIRECTORY)
    file(MAKE_DIRECTORY ${folder})
    file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${room}/${header} ${behind}/${header} SYMBOLIC)
    # "" is looked up beside the header first
    file(CREATE_LINK ${behind} ${folder}/${room} SYMBOLIC)
    foreach(lower ${ROOM_${room}})
      file(CREATE_LINK ${CMAKE_BINARY_DIR}/rooms/public/${lower} ${folder}/${lower} SYMBOLIC)
    endforeach()
  endforeach()
endfunction()

file(REMOVE_RECURSE ${CMAKE_BINARY_DIR}/rooms)     # links are not followed
foreach(room ${ROOMS})
  set(folder ${CMAKE_BINARY_DIR}/rooms/${room})
  file(MAKE_DIRECTORY ${folder})
  if(room STREQUAL bench)
    foreach(seen ${ROOMS})
      file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${seen} ${folder}/${seen} SYMBOLIC)
    endforeach()
    continue()
  endif()
  publish_room(${room})
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${room} ${folder}/${room} SYMBOLIC)
  foreach(seen ${ROOM_${room}})
    file(CREATE_LINK ${CMAKE_BINARY_DIR}/rooms/public/${seen} ${folder}/${seen} SYMBOLIC)
  endforeach()
endforeach()

# seldinger_room(TARGET ROOM): the target's sources are of that room.
function(seldinger_room target room)
  set(folder ${CMAKE_BINARY_DIR}/rooms/${room})
  target_include_directories(${target} PRIVATE ${folder})
  target_compile_options(${target} PRIVATE "-ffile-prefix-map=${folder}/=")
  if(room IN_LIST LIBRARY_ROOMS)
    set_target_properties(${target} PROPERTIES SELDINGER_SHARED ON)
  endif()
  # for tests/tools/arrows: all the folders that the target looks for headers in
  set(folders "$<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>")
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/rooms/${target}.flags CONTENT "-I$<JOIN:${folders},\n-I>\n")
endfunction()
