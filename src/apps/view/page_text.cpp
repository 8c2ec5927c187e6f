#include "src/apps/view/page_text.hpp"

// The assembler takes the file as it is; an array of its bytes would take the compiler seconds.
__asm__(
    ".section .rodata\n"
    ".global unimapper_page_begin\n"
    ".global unimapper_page_end\n"
    "unimapper_page_begin:\n"
    ".incbin \"" UNIMAPPER_PAGE
    "\"\n"
    "unimapper_page_end:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" {
extern const char unimapper_page_begin[];
extern const char unimapper_page_end[];
}

namespace unimapper::apps {

std::string_view page_text() {
  return {unimapper_page_begin,
          static_cast<std::size_t>(unimapper_page_end - unimapper_page_begin)};
}

}  // namespace unimapper::apps
