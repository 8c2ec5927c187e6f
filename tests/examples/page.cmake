# Page of examples: docs/examples.md made of the programs it shows.
#
# cmake [-DWRITE=ON] -DFOLDER=docs -P page.cmake    compares, or writes with -DWRITE=ON
cmake_policy(VERSION 3.25)
set(programs
  first_keyframe.cpp labels_into_buffer.cpp own_lidar.cpp budget_and_health.cpp
  deferred_work.cpp final_labels.cpp earlier_places.cpp descriptor_and_search.cpp read_recording.cpp
  over_lcm.cpp share_with_planner.cpp record_shared.cpp merge_sessions.cpp
  first_keyframe.c own_transport.c deliver.c)

set(page "# Examples

One question each, 20 to 40 lines. The tests compile and run every program, and check that this page
shows it as it is; `cmake --build build/release --target examples_page` writes the page anew. Which
level of the library suits whom is told in [using.md](using.md).
")
file(GLOB known RELATIVE "${FOLDER}/examples" "${FOLDER}/examples/*.c" "${FOLDER}/examples/*.cpp")
list(REMOVE_ITEM known ${programs})
if(known)
  message(FATAL_ERROR "docs/examples.md does not show: ${known}")
endif()
foreach(program IN LISTS programs)
  file(READ "${FOLDER}/examples/${program}" text)
  string(REGEX MATCHALL "\n" line_ends "${text}")
  list(LENGTH line_ends lines)
  if(lines LESS 20 OR lines GREATER 40)
    message(FATAL_ERROR "docs/examples/${program} has ${lines} lines, not 20 to 40")
  endif()
  string(REGEX REPLACE "^(//|/[*]) ([^\n]*[^.\n])[.]( [*]/)?\n.*" "\\2" heading "${text}")
  string(REGEX REPLACE "^.*[.]" "" language "${program}")
  string(APPEND page
    "\n## ${heading}\n\n[${program}](examples/${program})\n\n```${language}\n${text}```\n")
endforeach()

if(WRITE)
  file(WRITE "${FOLDER}/examples.md" "${page}")
  return()
endif()
file(READ "${FOLDER}/examples.md" shown)
if(NOT shown STREQUAL page)
  message(FATAL_ERROR "docs/examples.md does not show docs/examples as they are: build the target "
    "examples_page")
endif()
