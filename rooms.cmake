# Rooms and what each may include: a room's own folder of links is all that its sources see of ours, so that a wrong arrow does not compile.
# tests/tools/arrows has the same table and tries each arrow.
set(ROOMS base geom solver recon input sim render cli bench)
set(ROOM_base)
set(ROOM_geom base)
set(ROOM_solver base geom)
set(ROOM_recon base geom)
set(ROOM_input base)
set(ROOM_sim base geom solver recon input)
set(ROOM_render base geom recon input sim)
set(ROOM_cli base geom solver recon input sim render)
set(ROOM_bench base geom solver recon input sim render cli)
# what the headers of the first include of the second stays behind them: they are found from each other's folder, not from the room
set(ROOM_BEHIND_render sim solver)

# what libseldinger.so is made of
set(LIBRARY_ROOMS base geom solver recon input sim)

# The headers of `room` as links in `folder`.
function(link_headers room folder)
  file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_SOURCE_DIR}/${room} ${CMAKE_SOURCE_DIR}/${room}/*.h)
  file(MAKE_DIRECTORY ${folder})
  foreach(header ${headers})
    file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${room}/${header} ${folder}/${header} SYMBOLIC)
  endforeach()
endfunction()

foreach(room ${ROOMS})
  set(folder ${CMAKE_BINARY_DIR}/rooms/${room})
  file(GLOB_RECURSE former LIST_DIRECTORIES false ${folder}/*)     # links are not followed
  if(former)
    file(REMOVE ${former})
  endif()
  file(MAKE_DIRECTORY ${folder})
  set(behind ${ROOM_BEHIND_${room}})
  foreach(seen ${room} ${ROOM_${room}})
    if(seen IN_LIST behind)
      continue()
    endif()
    file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${seen} ${folder}/${seen} SYMBOLIC)
  endforeach()
  if(behind)
    list(POP_FRONT behind before)
    link_headers(${before} ${folder}/${before})
    link_headers(${behind} ${folder}/${before}/${behind})
    file(CREATE_LINK . ${folder}/${before}/${behind}/${behind} SYMBOLIC)
  endif()
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
