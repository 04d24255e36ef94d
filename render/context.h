#pragma once
/// An OpenGL context without a window. Only context_osmesa.cpp knows where it comes from.

#include <atomic>
#include <cfenv>
#include <memory>

namespace substep::render {

/// All drawing goes to framebuffer objects; objects made in the context live until it ends.
class Context {
 public:
  /// Throws Error when there is no software OpenGL of at least 3.3.
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Makes the context the calling thread's for its own lifetime, with the rounding mode that pictures
  /// depend on. Throws std::logic_error when the context is another thread's at the time: the driver would
  /// let both draw and mix them up.
  class Current {
   public:
    explicit Current(Context& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    Context& context_;
    int rounding_;
  };

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
  std::atomic_flag in_use_ = ATOMIC_FLAG_INIT;
};

}  // namespace substep::render
