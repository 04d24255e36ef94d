#pragma once
/// Frames painted on several threads and taken in order.

#include <functional>

#include "render/image.h"

namespace substep::render {

/// Paints frame k; used on one thread only.
using Painter = std::function<Image(int k)>;

/// Paints frames 0 … count − 1 on `threads` threads, each with a painter that `make_painter` makes on that
/// thread (an OpenGL context belongs to one), and calls `take` with them in order, on the calling thread. A
/// few frames a thread are held at once. The first exception of a painter or of `take` ends it all and is
/// thrown here.
void paint_in_order(int count, int threads, const std::function<Painter()>& make_painter,
                    const std::function<void(int k, const Image& frame)>& take);

}  // namespace substep::render
