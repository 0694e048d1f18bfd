#pragma once

// docs/image-formation.md, in the language of the graphics card.
namespace birdseye::host::shaders {

/// The volume resampled by a displacement field. One invocation a voxel.
inline constexpr const char* kWarp = R"(#version 450 core
layout(local_size_x = 8, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform isampler3D scan;
layout(binding = 1) uniform sampler3D moves;  // of the field's points, in voxels
layout(r16i, binding = 0) uniform writeonly iimage3D warped;
uniform mat4 lattice_from_voxel;

vec3 move_at(vec3 lattice) {
  ivec3 last = textureSize(moves, 0) - 1;
  if (any(lessThan(lattice, vec3(-1e-4))) || any(greaterThan(lattice, vec3(last) + 1e-4))) return vec3(0);
  lattice = clamp(lattice, vec3(0), vec3(last));
  ivec3 c = min(ivec3(lattice), last - 1);
  vec3 t = lattice - vec3(c);
  vec3 sum = vec3(0);
  for (int n = 0; n < 8; ++n) {
    ivec3 o = ivec3(n & 1, n >> 1 & 1, n >> 2);
    vec3 w = mix(1 - t, t, vec3(o));
    sum += w.x * w.y * w.z * texelFetch(moves, c + o, 0).xyz;
  }
  return sum;
}

void main() {
  ivec3 voxel = ivec3(gl_GlobalInvocationID);
  ivec3 last = textureSize(scan, 0) - 1;
  if (any(greaterThan(voxel, last))) return;
  vec3 x = vec3(voxel) + move_at((lattice_from_voxel * vec4(voxel, 1)).xyz);
  int hu = -1024;
  if (all(greaterThanEqual(x, vec3(0))) && all(lessThanEqual(x, vec3(last)))) {
    ivec3 c = min(ivec3(x), last - 1);
    vec3 t = x - vec3(c);
    float sum = 0;
    for (int n = 0; n < 8; ++n) {
      ivec3 o = ivec3(n & 1, n >> 1 & 1, n >> 2);
      vec3 w = mix(1 - t, t, vec3(o));
      sum += w.x * w.y * w.z * float(texelFetch(scan, c + o, 0).r);
    }
    hu = int(round(sum));
  }
  imageStore(warped, voxel, ivec4(hu));
}
)";

/// Shade and highlight of each voxel.
inline constexpr const char* kLight = R"(#version 450 core
layout(local_size_x = 8, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform isampler3D volume;
layout(rg8, binding = 0) uniform writeonly image3D light;
uniform mat4 patient_from_voxel;
uniform mat3 patient_gradient;
uniform vec3 eye;
uniform vec4 lamp;  // ambient, diffuse, specular, shininess
uniform float per_surface_gradient;

float hu(ivec3 at) { return float(texelFetch(volume, clamp(at, ivec3(0), textureSize(volume, 0) - 1), 0).r); }

void main() {
  ivec3 v = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(v, textureSize(volume, 0)))) return;
  ivec3 e = ivec3(1, 0, 0);
  vec3 g = patient_gradient * (0.5 * vec3(hu(v + e.xyy) - hu(v - e.xyy), hu(v + e.yxy) - hu(v - e.yxy), hu(v + e.yyx) - hu(v - e.yyx)));
  vec3 d = (patient_from_voxel * vec4(v, 1)).xyz - eye;
  float steep = length(g);
  float facing = steep > 0 ? min(1.0, abs(dot(g, d)) / (steep * length(d))) : 0.0;
  float m = min(1.0, steep * per_surface_gradient);
  float shade = 1 - m + m * (lamp.x + lamp.y * facing);
  float highlight = m * lamp.z * (facing > 0 ? pow(facing, lamp.w) : 0.0);
  imageStore(light, v, vec4(shade, highlight, 0, 0));
}
)";

/// Which bricks of 4x4x4 cells hold anything that is seen: 0 for those, 255 for the others.
inline constexpr const char* kSeen = R"(#version 450 core
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform isampler3D volume;
layout(r8ui, binding = 0) uniform writeonly uimage3D bricks;
layout(std430, binding = 0) readonly buffer Seen { int seen_up_to[]; };  // running count over HU from -1024

void main() {
  ivec3 brick = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(brick, imageSize(bricks)))) return;
  ivec3 last = textureSize(volume, 0) - 1;
  int low = 32767, high = -32768;
  for (int n = 0; n < 125; ++n) {
    int hu = texelFetch(volume, min(brick * 4 + ivec3(n % 5, n / 5 % 5, n / 25), last), 0).r;
    low = min(low, hu);
    high = max(high, hu);
  }
  bool any_seen = seen_up_to[clamp(high, -1024, 3071) + 1025] > seen_up_to[clamp(low, -1024, 3071) + 1024];
  imageStore(bricks, brick, uvec4(any_seen ? 0 : 255));
}
)";

/// One step of the distance to the nearest brick that is seen.
inline constexpr const char* kGrow = R"(#version 450 core
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform usampler3D from;
layout(r8ui, binding = 0) uniform writeonly uimage3D to;

void main() {
  ivec3 brick = ivec3(gl_GlobalInvocationID);
  ivec3 last = textureSize(from, 0) - 1;
  if (any(greaterThan(brick, last))) return;
  uint nearest = texelFetch(from, brick, 0).r;
  for (int n = 0; n < 27 && nearest > 0; ++n) {
    ivec3 at = clamp(brick + ivec3(n % 3, n / 3 % 3, n / 9) - 1, ivec3(0), last);
    nearest = min(nearest, texelFetch(from, at, 0).r + 1);
  }
  imageStore(to, brick, uvec4(min(nearest, 255u)));
}
)";

/// One triangle over the whole picture.
inline constexpr const char* kWhole = R"(#version 450 core
void main() {
  gl_Position = vec4(vec2(gl_VertexID << 1 & 2, gl_VertexID & 2) * 2 - 1, 0, 1);
}
)";

inline constexpr const char* kCast = R"(#version 450 core
layout(binding = 0) uniform isampler3D volume;
layout(binding = 1) uniform sampler3D light;
layout(binding = 2) uniform usampler3D bricks;
layout(binding = 3) uniform sampler2D directions;  // unit, camera frame; zero where the lens does not see
layout(binding = 4) uniform sampler2D transfer;    // colour and opacity, 64 x 64 over HU from -1024
uniform vec3 origin;  // of the rays, voxels
uniform mat3 voxels_from_camera;
uniform vec4 clip;  // normal in the camera frame; normal . p - offset at the rays' origin
uniform float near_mm, step_mm;
uniform int leaps;  // distances beyond this are no more than it
out vec4 colour;

float value_at(vec3 x, ivec3 last) {
  ivec3 c = min(ivec3(x), max(last - 1, 0));
  vec3 t = x - vec3(c);
  ivec3 o = min(ivec3(1), last);
  float v[8];
  for (int n = 0; n < 8; ++n) v[n] = float(texelFetch(volume, c + o * ivec3(n & 1, n >> 1 & 1, n >> 2), 0).r);
  vec4 along_x = mix(vec4(v[0], v[2], v[4], v[6]), vec4(v[1], v[3], v[5], v[7]), t.x);
  vec2 along_y = mix(along_x.xz, along_x.yw, t.y);
  return mix(along_y.x, along_y.y, t.z);
}

void main() {
  colour = vec4(0);
  vec3 in_camera = texelFetch(directions, ivec2(gl_FragCoord.xy), 0).xyz;
  if (in_camera.z == 0) return;
  ivec3 size = textureSize(volume, 0);
  ivec3 last = size - 1;
  vec3 d = voxels_from_camera * in_camera;
  d = mix(d, vec3(1e-9), lessThan(abs(d), vec3(1e-9)));
  vec3 a = -origin / d, b = (vec3(last) - origin) / d;
  vec3 low = min(a, b), high = max(a, b);
  float near = max(max(near_mm, low.x), max(low.y, low.z));
  float far = min(high.x, min(high.y, high.z));
  if (clip.xyz != vec3(0)) {
    float rate = dot(clip.xyz, in_camera);
    float s = -clip.w / (abs(rate) < 1e-9 ? 1e-9 : rate);
    if (rate > 0) near = max(near, s); else far = min(far, s);
  }
  float i = max(0.0, ceil(near / step_mm - 0.5));
  float end = floor(far / step_mm - 0.5);
  vec3 sum = vec3(0);
  float through = 1;
  while (i <= end && through >= 1.0 / 64) {
    vec3 x = clamp(origin + (i + 0.5) * step_mm * d, vec3(0), vec3(last));
    ivec3 brick = min(ivec3(x) / 4, textureSize(bricks, 0) - 1);
    float empty = float(min(texelFetch(bricks, brick, 0).r, uint(leaps)));
    if (empty > 0) {
      vec3 face = mix(vec3(brick) - empty + 1, vec3(brick) + empty, greaterThan(d, vec3(0))) * 4;
      vec3 mm = (face - x) / d;
      i += floor(max(0.0, min(mm.x, min(mm.y, mm.z))) / step_mm * (1 - 1e-5)) + 1;
      continue;
    }
    i += 1;
    int hu = clamp(int(round(value_at(x, last))) + 1024, 0, 4095);
    vec4 c = texelFetch(transfer, ivec2(hu & 63, hu >> 6), 0);
    if (c.a == 0) continue;
    vec2 lit = texture(light, (x + 0.5) / vec3(size)).rg;
    sum += through * c.a * (c.rgb * lit.r + lit.g);
    through *= 1 - c.a;
  }
  float covered = 1 - through;
  bool opaque = through < 1.0 / 64;
  colour = vec4(opaque ? sum / covered : sum, opaque ? 1 : covered);
  colour.rgb = min(colour.rgb, colour.a);
}
)";

}  // namespace birdseye::host::shaders
