#pragma once
/// An OpenGL context without a window. Only context_osmesa.cpp knows where it comes from.

#include <cfenv>
#include <memory>
#include <mutex>

namespace substep::render {

/// All drawing goes to framebuffer objects; objects made in the context live until it ends.
class Context {
 public:
  /// Throws Error when there is no software OpenGL of at least 3.3.
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Waits until no other thread has the context, then makes it the calling thread's for its own lifetime,
  /// with the rounding mode that pictures depend on. The driver would let two threads draw and mix them up.
  class Current {
   public:
    explicit Current(Context& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;

   private:
    std::lock_guard<std::mutex> lock_;
    int rounding_;
  };

 private:
  struct Handle;
  std::unique_ptr<Handle> handle_;
  std::mutex mutex_;
};

}  // namespace substep::render
