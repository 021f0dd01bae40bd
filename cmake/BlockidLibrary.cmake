# One folder, one library.

include_guard(GLOBAL)

include(BlockidPrecompiled)

# blockid_add_library(<folder>
#   SOURCES <file>...
#   [PUBLIC_LIBS <target>...]          seen in our headers: other folders (blockid::data), Eigen3::Eigen, ...
#   [PRIVATE_LIBS <target>...]         linked, but used in .cpp files only
#   [PRIVATE_HEADER_LIBS <target>...]  header-only and used in .cpp files only: no trace in the installed package
#   [HEADER_DIRS <subfolder>...])      subfolders published as <blockid/<subfolder>/...> of their own
#
# Creates the library blockid_<folder>, alias blockid::<folder>, of the calling folder. Its include root in the build
# tree holds only links to the folder itself, so that <blockid/other/...> compiles only if `other` is among the
# libraries it links to. All *.hpp are installed below include/blockid/<folder>/.
function(blockid_add_library folder)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" ""
                        "SOURCES;PUBLIC_LIBS;PRIVATE_LIBS;PRIVATE_HEADER_LIBS;HEADER_DIRS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "blockid_add_library(${folder}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()

  set(target blockid_${folder})
  set(include_root "${PROJECT_BINARY_DIR}/include/${folder}")
  blockid_link_headers("${CMAKE_CURRENT_SOURCE_DIR}" "${include_root}/blockid/${folder}")
  foreach(dir IN LISTS arg_HEADER_DIRS)
    blockid_link_headers("${CMAKE_CURRENT_SOURCE_DIR}/${dir}" "${include_root}/blockid/${dir}")
  endforeach()

  if(arg_SOURCES)
    set(scope PUBLIC)
    add_library(${target} ${arg_SOURCES})
    blockid_set_compile_flags(${target})
    blockid_precompile_headers(${target})
    blockid_batch_sources(${target})
  else()
    set(scope INTERFACE)
    add_library(${target} INTERFACE)
  endif()
  add_library(blockid::${folder} ALIAS ${target})

  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${folder}
               VERSION ${PROJECT_VERSION}
               SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} "$<BUILD_INTERFACE:${include_root}>"
                                                "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  target_link_libraries(${target} ${scope} ${arg_PUBLIC_LIBS})
  if(arg_SOURCES)
    target_link_libraries(${target} PRIVATE ${arg_PRIVATE_LIBS})
    foreach(lib IN LISTS arg_PRIVATE_HEADER_LIBS)
      target_link_libraries(${target} PRIVATE "$<BUILD_INTERFACE:${lib}>")
    endforeach()
  endif()

  if(BLOCKID_INSTALL)
    install(TARGETS ${target} EXPORT blockidTargets)
    set(exclusions "")
    foreach(dir IN LISTS arg_HEADER_DIRS)
      install(
        DIRECTORY "${dir}/"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/blockid/${dir}"
        FILES_MATCHING
        PATTERN "*.hpp")
      list(APPEND exclusions PATTERN "${dir}" EXCLUDE)
    endforeach()
    install(
      DIRECTORY "./"
      DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/blockid/${folder}"
      FILES_MATCHING
      PATTERN "*.hpp" ${exclusions})
  endif()

  set_property(GLOBAL APPEND PROPERTY BLOCKID_FOLDERS ${folder})
endfunction()

# blockid_link_headers(<folder> <link>): makes <link> a symbolic link to <folder>.
function(blockid_link_headers folder link)
  cmake_path(GET link PARENT_PATH parent)
  file(MAKE_DIRECTORY "${parent}")
  file(CREATE_LINK "${folder}" "${link}" SYMBOLIC)
endfunction()

# blockid_add_umbrella(): the target blockid::blockid, everything that blockid_add_library() made so far.
function(blockid_add_umbrella)
  get_property(folders GLOBAL PROPERTY BLOCKID_FOLDERS)
  list(TRANSFORM folders PREPEND "blockid::")
  add_library(blockid_blockid INTERFACE)
  add_library(blockid::blockid ALIAS blockid_blockid)
  set_target_properties(blockid_blockid PROPERTIES EXPORT_NAME blockid)
  target_link_libraries(blockid_blockid INTERFACE ${folders})
  if(BLOCKID_INSTALL)
    install(TARGETS blockid_blockid EXPORT blockidTargets)
  endif()
endfunction()

# blockid_add_program(<name> SOURCES <file>... [LIBS <target>...]): an executable with our flags; not installed.
function(blockid_add_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "blockid_add_program(${name}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  add_executable(${name} ${arg_SOURCES})
  blockid_set_compile_flags(${name})
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_link_libraries(${name} PRIVATE ${arg_LIBS})
endfunction()
