// Drawing of bodies: their shapes alone, their surfaces, and layers of surfaces that light passes through.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "render/renderer_implementation.h"

namespace substep::render {
namespace {

using Kind = shaders::Program::Kind;

glm::dmat4 matrix(const Coordinates& q) {
  const Matrix3 rotation = q.angular.toRotationMatrix();
  glm::dmat4 result(1);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) result[column][row] = rotation(row, column);
    result[3][column] = q.linear[column];
  }
  return result;
}

const void* offset(std::size_t bytes) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL takes offsets in its buffers as pointers.
  return reinterpret_cast<const void*>(bytes);
}

void draw_indices(std::size_t begin, std::size_t end) {
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(end - begin), GL_UNSIGNED_INT,
                 offset(begin * sizeof(std::uint32_t)));
}

/// Returns the body whose pose comes first in the program's blocks when this one is drawn.
std::size_t first_in_block(std::size_t body) {
  return body / shaders::bodies_at_once * shaders::bodies_at_once;
}

}  // namespace

void Renderer::Implementation::upload_bodies() {
  body_array = objects.vertex_array();
  glBindVertexArray(body_array);
  const auto upload = [&](GLenum target, const auto& values) {
    glBindBuffer(target, objects.buffer());
    glBufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof values[0]), values.data(),
                 GL_STATIC_DRAW);
  };
  const auto attribute = [](GLuint index, GLint count, std::size_t from, GLsizei stride,
                            GLenum type = GL_FLOAT) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, count, type, GL_FALSE, stride, offset(from));
  };
  upload(GL_ARRAY_BUFFER, mesh.vertices);
  attribute(0, 3, offsetof(Vertex, position), sizeof(Vertex));
  attribute(1, 3, offsetof(Vertex, normal), sizeof(Vertex));
  attribute(2, 3, offsetof(Vertex, color), sizeof(Vertex));
  attribute(3, 2, offsetof(Vertex, metallic), sizeof(Vertex));
  upload(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
  // Each vertex's body within its block.
  std::vector<std::uint16_t> bodies(mesh.vertices.size());
  for (const Part& part : mesh.parts) {
    for (std::size_t i = part.begin; i < part.end; ++i) {
      bodies[mesh.indices[i]] = static_cast<std::uint16_t>(part.body % shaders::bodies_at_once);
    }
  }
  upload(GL_ARRAY_BUFFER, bodies);
  attribute(8, 1, 0, sizeof(std::uint16_t), GL_UNSIGNED_SHORT);
  pose_buffers = {objects.buffer(), objects.buffer()};
  if (!looks) return;
  upload(GL_ARRAY_BUFFER, mesh.looks);
  attribute(4, 4, offsetof(LookVertex, coordinates), sizeof(LookVertex));
  attribute(5, 4, offsetof(LookVertex, color), sizeof(LookVertex));
  attribute(6, 4, offsetof(LookVertex, tangent), sizeof(LookVertex));
  attribute(7, 2, offsetof(LookVertex, density), sizeof(LookVertex));
}

/// Sets the poses of the bodies from `first` on, as many as a program's blocks take.
void Renderer::Implementation::set_poses(GLuint program, const glm::dmat4& clip, Poses poses,
                                         std::size_t first) const {
  // Move bodies that cannot be drawn beside the picture.
  glm::mat4 beside(0);
  beside[3] = {2, 2, 0, 1};
  std::array<std::vector<glm::mat4>, 2> blocks;
  blocks[0].assign(shaders::bodies_at_once, beside);
  blocks[1].assign(shaders::bodies_at_once, glm::mat4(0));
  for (std::size_t i = first; i < std::min(poses.size(), first + shaders::bodies_at_once); ++i) {
    if (!is_drawable(poses[i])) continue;
    const glm::dmat4 world = matrix(poses[i]);
    blocks[0][i - first] = glm::mat4(clip * world);
    blocks[1][i - first] = glm::mat4(world);
  }
  for (GLuint block = 0; block < 2; ++block) {
    glBindBuffer(GL_UNIFORM_BUFFER, pose_buffers[block]);
    glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(shaders::bodies_at_once * sizeof(glm::mat4)),
                 blocks[block].data(), GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, clip_poses_block + block, pose_buffers[block]);
  }
  if (program != 0) glUniform1i(glGetUniformLocation(program, "first_body"), static_cast<GLint>(first));
}

/// Draws all bodies with the program in use. Of closed parts, faces that point away from the eye are left
/// out; `hidden` is GL_FRONT where `clip` mirrors.
void Renderer::Implementation::draw_batches(GLuint program, const glm::dmat4& clip, Poses poses,
                                            GLenum hidden) const {
  glBindVertexArray(body_array);
  glCullFace(hidden);
  std::optional<std::size_t> set;
  for (auto part = mesh.parts.begin(); part != mesh.parts.end();) {
    const std::size_t first = first_in_block(part->body);
    const auto end = std::find_if(part, mesh.parts.end(), [&](const Part& other) {
      return first_in_block(other.body) != first || other.is_closed != part->is_closed;
    });
    if (set != first) set_poses(program, clip, poses, first);
    set = first;
    if (part->is_closed) glEnable(GL_CULL_FACE);
    draw_indices(part->begin, std::prev(end)->end);
    glDisable(GL_CULL_FACE);
    part = end;
  }
}

/// Draws the parts for whose index `shows` returns true, after it has set what their surfaces need, and the
/// program where `program` is 0.
void Renderer::Implementation::draw_parts(GLuint program, const glm::dmat4& clip, Poses poses,
                                          const std::function<bool(std::size_t)>& shows) const {
  glBindVertexArray(body_array);
  std::optional<std::size_t> set;
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const Part& part = mesh.parts[i];
    if (!is_drawable(poses[part.body]) || !shows(i)) continue;
    const std::size_t first = first_in_block(part.body);
    if (set != first) set_poses(program, clip, poses, first);
    set = first;
    draw_indices(part.begin, part.end);
  }
}

bool Renderer::Implementation::has(Surface::Opacity opacity) const {
  return std::ranges::find(mesh.surfaces, opacity, &Surface::opacity) != mesh.surfaces.end();
}

/// Draws depth or colour alone of all bodies, except of surfaces that light passes through unless wanted.
void Renderer::Implementation::draw_solid(Kind kind, const glm::dmat4& clip, Poses poses, GLenum hidden,
                                          bool is_blended_too) {
  const GLuint program = device->use({.kind = kind});
  if (!looks) {
    draw_batches(program, clip, poses, hidden);
    return;
  }
  draw_parts(program, clip, poses, [&](std::size_t part) {
    const Surface::Opacity opacity = mesh.surfaces[part].opacity;
    return opacity == Surface::Opacity::opaque || (is_blended_too && opacity == Surface::Opacity::blended);
  });
  if (!has(Surface::Opacity::cut)) return;
  const GLuint cutting = device->use({.kind = Kind::color, .may_discard = true});
  draw_parts(cutting, clip, poses, [&](std::size_t part) {
    const Surface& surface = mesh.surfaces[part];
    if (surface.opacity != Surface::Opacity::cut) return false;
    set_surface(cutting, surface, textures[part]);
    return true;
  });
}

/// Draws the nearest surfaces of all bodies. Surfaces of the world, which take longest where they have
/// textures, are kept when a view is drawn a second time; then they are copied to where bodies were in the
/// last frame.
void Renderer::Implementation::draw_surfaces(Poses poses) {
  if (!looks) {
    surfaces.start();
    draw_batches(device->use({.kind = Kind::body}), clip_from_world, poses);
    return;
  }
  const auto draw = [&](Bodies which) {
    for (const Surface::Opacity opacity : {Surface::Opacity::opaque, Surface::Opacity::cut}) {
      draw_looks(poses, opacity, false, which);
    }
  };
  if (shines || tile_view != kept_view) {
    has_kept = false;
    kept_view = tile_view;
    surfaces.start();
    Surfaces::clear();
    draw(Bodies::all);
    return;
  }
  if (!has_kept) {
    if (kept.framebuffer == 0) kept = Surfaces(objects, surfaces.width, surfaces.height, false);
    kept.start();
    Surfaces::clear();
    draw(Bodies::of_world);
    moved = {{0, 0, picture.width, picture.height}};
    has_kept = true;
  }
  surfaces.copy(kept, moved, samples(), GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  draw(Bodies::moving);
  moved = areas_of(moving, poses, clip_from_world, picture.width, picture.height);
}

/// Draws surfaces; with `is_behind`, only those behind nearer_unit's depth.
void Renderer::Implementation::draw_looks(Poses poses, Surface::Opacity opacity, bool is_behind,
                                          Bodies which) {
  const glm::vec4 eye = glm::dvec4(tile_view.eye, 2 * tile_view.tangent_y / surfaces.height);
  draw_parts(0, clip_from_world, poses, [&](std::size_t part) {
    const Surface& surface = mesh.surfaces[part];
    const bool is_of_world = mesh.parts[part].body == world_body;
    const bool is_wanted = which == Bodies::all || (which == Bodies::of_world) == is_of_world;
    if (surface.opacity != opacity || !is_wanted) return false;
    device->use_surface(surface, textures[part], eye, is_behind, shines);
    return true;
  });
  glDisable(GL_CULL_FACE);
}

/// Draws the nearest surfaces that light passes through, from the second layer on those behind the layer
/// before. Returns false where there are none.
bool Renderer::Implementation::draw_layer(Poses poses, std::size_t index) {
  const Surfaces& layer = layers[index % 2];
  const Rectangle whole{0, 0, picture.width, picture.height};
  layer.copy(surfaces, std::array{whole}, samples(), GL_DEPTH_BUFFER_BIT);
  Surfaces::clear();
  bind_texture(nearer_unit, layers[(index + 1) % 2].depth);
  GLuint query = 0;
  glGenQueries(1, &query);
  glBeginQuery(GL_SAMPLES_PASSED, query);
  draw_looks(poses, Surface::Opacity::blended, index > 0, Bodies::all);
  glEndQuery(GL_SAMPLES_PASSED);
  GLuint passed = 0;
  glGetQueryObjectuiv(query, GL_QUERY_RESULT, &passed);
  glDeleteQueries(1, &query);
  if (passed == 0) return false;
  light_surfaces(layer.depth, areas);
  lighting.read(picture);
  return true;
}

/// Lays the nearest layers of surfaces that light passes through over the picture, from back to front.
Image Renderer::Implementation::draw_layers(Poses poses) {
  constexpr std::size_t most = 8;
  SampleLight result = light_of_samples(rendered());
  std::vector<std::array<std::vector<std::uint8_t>, 3>> drawn;
  while (drawn.size() < most && draw_layer(poses, drawn.size())) drawn.push_back(lighting.pixels);
  for (auto layer = drawn.rbegin(); layer != drawn.rend(); ++layer) {
    RenderedPixels over = rendered();
    over.first = (*layer)[0];
    over.second = (*layer)[1];
    lay_over(result, over, (*layer)[2]);
  }
  return resolved(result, picture.width, picture.height, samples());
}

}  // namespace substep::render
