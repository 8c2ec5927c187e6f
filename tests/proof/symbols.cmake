# Symbol test: the LIBRARIES must not use the C++ runtime, the heap or threads.
cmake_policy(VERSION 3.22)

# What the onboard libraries ask of the outside world: nothing but memory copies, the length of a
# text, and a few functions of the maths library. No heap, no exceptions, no threads, no input or
# output.
#
# Nor do they hold what only exceptions and RTTI would leave behind.
#
# cmake -DNM=... -DLIBRARIES=a;b;c -P symbols.cmake
execute_process(COMMAND ${NM} -P ${LIBRARIES} OUTPUT_VARIABLE listing RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${NM} could not read ${LIBRARIES}")
endif()

set(allowed
  memset memcpy memmove memcmp strlen
  sqrt sqrtf cos lroundf floorf ceil ceilf
  # the compiler's own support library: counting bits, and on 32-bit ARM dividing and converting
  __popcountdi2 __ctzdi2
  __aeabi_idiv __aeabi_idivmod __aeabi_uidiv __aeabi_uidivmod __aeabi_ldivmod __aeabi_uldivmod
  __aeabi_l2f __aeabi_ul2f __aeabi_l2d __aeabi_ul2d __aeabi_f2lz __aeabi_f2ulz __aeabi_d2lz
  __aeabi_d2ulz
  # ... what the x86-64 processor can do
  __cpu_model
  # ... the address of the table of addresses, which the linker knows
  _GLOBAL_OFFSET_TABLE_
  # ... and the event ring's atomic addition, where aarch64 has two instructions for it
  __aarch64_ldadd4_relax)

# One line per symbol: name, kind, ... Global definitions first: the libraries may use each other.
string(REGEX MATCHALL "[^\n]+ [TWVDBRu] [^\n]*" defined_lines "${listing}")
foreach(line IN LISTS defined_lines)
  string(REGEX REPLACE " .*" "" name "${line}")
  set(defined_${name} TRUE)
endforeach()

set(forbidden "")
string(REGEX MATCHALL "[^\n]+ [Uwv][ \n]" undefined_lines "${listing}")
list(LENGTH undefined_lines undefined_count)
if(undefined_count EQUAL 0)
  message(FATAL_ERROR "no undefined symbol at all: the listing was not understood")
endif()
foreach(line IN LISTS undefined_lines)
  string(REGEX REPLACE " .*" "" name "${line}")
  if(NOT defined_${name} AND NOT name IN_LIST allowed)
    list(APPEND forbidden ${name})
  endif()
endforeach()
list(REMOVE_DUPLICATES forbidden)
if(forbidden)
  message(FATAL_ERROR "the onboard libraries must not use: ${forbidden}")
endif()

# A program compiled with other options has copies of Eigen's functions too, which compute other
# bits; the linker takes one copy for all. So the libraries must have inlined every one of theirs.
string(REGEX MATCHALL "_ZNK?5Eigen[^ \n]* W" replaceable "${listing}")
if(replaceable)
  message(FATAL_ERROR "a program's own copy could replace: ${replaceable}")
endif()

# Type information, its names, and tables of landing pads.
string(REGEX MATCH "(_ZTI|_ZTS|GCC_except_table|__gxx_personality)[^\n]*" runtime "${listing}")
if(runtime)
  message(FATAL_ERROR "the onboard libraries were built with exceptions or RTTI: ${runtime}")
endif()
message(STATUS "${undefined_count} references, all within the whitelist")
