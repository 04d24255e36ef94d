#pragma once
/// Files embedded in the program.

#include <string_view>

/// Defines the function `name`, which returns the bytes of the file at `path`, a literal. At file scope, once
/// a name; the build must be told that the source depends on the file (OBJECT_DEPENDS).
// NOLINTBEGIN(bugprone-macro-parentheses): assembly and declarations have none.
#define SUBSTEP_EMBEDDED_FILE(name, path)                                          \
  asm(".section .rodata\n.balign 16\nsubstep_embedded_" #name ":\n.incbin \"" path \
      "\"\nsubstep_embedded_" #name "_end:\n.previous\n");                         \
  extern "C" const char substep_embedded_##name[];                                 \
  extern "C" const char substep_embedded_##name##_end[];                           \
  static std::string_view name() {                                                 \
    return {substep_embedded_##name, substep_embedded_##name##_end};               \
  }
// NOLINTEND(bugprone-macro-parentheses)
