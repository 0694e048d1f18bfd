#pragma once

namespace birdseye::host::shaders {

/// Light needs the gradient of the volume as it was scanned, HU per voxel.
inline constexpr const char* kGradient = R"(#version 450 core
layout(local_size_x = 8, local_size_y = 4, local_size_z = 4) in;
layout(binding = 0) uniform sampler3D volume;
layout(rgba16f, binding = 0) uniform writeonly image3D gradient;

float hu(ivec3 at) { return texelFetch(volume, clamp(at, ivec3(0), textureSize(volume, 0) - 1), 0).r; }

void main() {
  ivec3 v = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(v, textureSize(volume, 0)))) return;
  ivec3 e = ivec3(1, 0, 0);
  vec3 g = 0.5 * vec3(hu(v + e.xyy) - hu(v - e.xyy), hu(v + e.yxy) - hu(v - e.yxy), hu(v + e.yyx) - hu(v - e.yyx));
  imageStore(gradient, v, vec4(g, 0));
}
)";

/// A vertex of a slice: where it is, and which voxel the deformed volume shows there.
inline constexpr const char* kSliceVertex = R"(#version 450 core
layout(location = 0) in vec3 at;    // voxels
layout(location = 1) in vec3 from;  // voxels
layout(location = 2) in int patch_of;
uniform mat4 camera_from_voxel;
uniform vec4 lens;          // fx, fy, cx, cy
uniform vec4 distortion;    // k1, k2, p1, p2
uniform float k3;
uniform vec2 size_px;
out vec3 source;
out vec3 in_camera;
flat out int patch_index;

void main() {
  vec3 p = (camera_from_voxel * vec4(at, 1)).xyz;
  source = from;
  in_camera = p;
  patch_index = patch_of;
  vec2 n = p.xy / p.z;
  float r2 = dot(n, n);
  float radial = 1 + r2 * (distortion.x + r2 * (distortion.y + r2 * k3));
  vec2 t = distortion.zw;
  vec2 d = n * radial + vec2(2 * t.x * n.x * n.y + t.y * (r2 + 2 * n.x * n.x), t.x * (r2 + 2 * n.y * n.y) + 2 * t.y * n.x * n.y);
  vec2 pixel = lens.xy * d + lens.zw;
  // Pixel centres at integers; row 0 first. z in metres, so that what lies behind the camera is cut away.
  vec2 clip = (pixel + 0.5) / size_px * 2 - 1;
  gl_Position = p.z > 1 ? vec4(clip * p.z, 0, p.z) : vec4(2, 2, 2, 1);
}
)";

inline constexpr const char* kSliceFragment = R"(#version 450 core
layout(binding = 0) uniform sampler3D volume;
layout(binding = 1) uniform sampler3D gradient;
layout(binding = 2) uniform sampler2D transfer;  // colour and extinction, 64 x 64 over HU from -1024
layout(std430, binding = 0) readonly buffer Patches { mat4 affine[]; };  // d(source) / d(place) of each patch, voxels
in vec3 source;
in vec3 in_camera;
flat in int patch_index;
uniform mat3 patient_gradient;    // from HU per voxel
uniform mat3 patient_from_camera;
uniform vec3 axis;                // across the slices, camera frame, unit
uniform float spacing_mm;
uniform vec4 lamp;                // ambient, diffuse, specular, shininess
uniform float per_surface_gradient;
uniform vec4 clip;                // camera frame
uniform float near_mm;
uniform float fold;               // tangent of the angle where the lens folds: what lies beyond is not seen
out vec4 colour;

void main() {
  ivec3 size = textureSize(volume, 0);
  if (any(lessThan(source, vec3(0))) || any(greaterThan(source, vec3(size - 1)))) discard;
  if (dot(in_camera.xy, in_camera.xy) > fold * fold * in_camera.z * in_camera.z) discard;
  if (length(in_camera) < near_mm || dot(clip.xyz, in_camera) + clip.w < 0) discard;
  vec3 place = (source + 0.5) / vec3(size);
  int hu = clamp(int(round(texture(volume, place).r)) + 1024, 0, 4095);
  vec4 c = texelFetch(transfer, ivec2(hu & 63, hu >> 6), 0);
  if (c.a == 0) discard;
  vec3 d = normalize(in_camera);
  float alpha = 1 - exp(-c.a * spacing_mm / max(0.05, abs(dot(d, axis))));
  // Equation 3: one affine map a patch turns the light instead of every gradient.
  vec3 g = patient_gradient * (transpose(mat3(affine[patch_index])) * texture(gradient, place).xyz);
  float steep = length(g);
  float facing = steep > 0 ? min(1.0, abs(dot(g, patient_from_camera * d)) / steep) : 0.0;
  float m = min(1.0, steep * per_surface_gradient);
  float shade = 1 - m + m * (lamp.x + lamp.y * facing);
  float highlight = m * lamp.z * (facing > 0 ? pow(facing, lamp.w) : 0.0);
  colour = vec4(min(c.rgb * shade + highlight, vec3(1)) * alpha, alpha);
}
)";

}  // namespace birdseye::host::shaders
