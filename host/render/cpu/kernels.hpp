#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace birdseye::host::cpu {

// What the inner loops are given: plain structures. The loops are compiled once per instruction set. If they shared
// inline functions with the rest of the program, the linker might keep a version of such a function that not every
// machine can run.

inline constexpr int kBrick = 4;  ///< cells of a brick along an axis
/// GridView::distance holds for each brick its distance to the nearest brick that is seen. For a brick that is seen
/// itself it holds kSeenBrick plus how many bricks all around it are seen too.
inline constexpr int kSeenBrick = 128;

inline constexpr int kLowestHu = -1024, kHighestHu = 3071;  ///< HU are cut to this range, that of a transfer function

/// The count of voxels from one slice to the next is a multiple of this.
inline constexpr int kSliceUnitBits = 8, kSliceUnit = 1 << kSliceUnitBits;
/// The strides of rows, and of slices in units of kSliceUnit, are at most this: they are multiplied in 16 bits.
inline constexpr int kLongestRow = 32767;
inline constexpr int kHuBits = 4;                        ///< HU are kept times 16, in 16 bits
inline constexpr float kLightUnit = 1.0F / (255 * 127);  ///< of a sample's shade and highlight

/// Voxels of 32 bits: 16 (HU - kLowestHu) (16), shade (8), highlight (8). A border of one voxel, a copy of the
/// nearest, surrounds them, so that neighbours and cells need no clamping.
struct GridView {
  std::uint32_t* voxels = nullptr;  ///< voxel (0, 0, 0)
  int size[3] = {};
  std::int64_t row = 0, slice = 0;         ///< voxels from one to the next along y and z; see kSliceUnit
  const std::uint8_t* distance = nullptr;  ///< of each brick, see kSeenBrick
  int bricks[3] = {};
};

/// One picture (docs/image-formation.md).
struct CastJob {
  GridView grid;
  /// Blocks of 4x4 pixels: 16 x, 16 y, 16 z; unit, camera frame; zero where the lens does not see.
  const float* directions = nullptr;
  const float* ranges =
      nullptr;  ///< of each block: from where to where anything is seen, mm; nothing is where to < from
  int width_px = 0, height_px = 0, blocks_per_row = 0;
  float origin[3] = {};                 ///< of the rays, voxels
  float voxels_from_camera[3][3] = {};  ///< row by row
  float clip_normal[3] = {};            ///< camera frame; zero for no clip plane
  float clip_at_origin_mm = 0;          ///< normal . p - offset at the rays' origin
  float near_mm = 0, step_mm = 0;
  const std::uint64_t* transfer = nullptr;  ///< per HU from -1024: opacity as float, colour in 3 x 10 bits above it
  std::uint8_t* rgba = nullptr;
};

/// Shade and highlight of voxels, from their neighbours.
struct LightJob {
  GridView grid;
  float patient_from_voxel[3][3] = {};  ///< linear part, row by row, mm
  float first_from_eye_mm[3] = {};      ///< from the eye to voxel (0, 0, 0), patient frame
  float patient_gradient[3][3] = {};    ///< from the difference of a voxel's two neighbours on each axis, HU per mm
  float per_surface_gradient = 0;       ///< 1 / g0
  float ambient = 0, diffuse = 0;
  const float* highlight = nullptr;  ///< specular * t^shininess at t = i / kFacings
};
inline constexpr int kFacings = 2048;

/// The volume resampled by a displacement field.
struct WarpJob {
  GridView grid;  ///< to be written: HU, without light
  const std::int16_t* source = nullptr;
  int field_size[3] = {};
  const float* moves[3] = {};  ///< of the field's points, in voxels of the volume
  float lattice_from_voxel[3][3] = {};
  float lattice_origin[3] = {};  ///< of voxel (0, 0, 0)
  bool aligned = false;          ///< the field's axes are the volume's, and it is no longer than kLongestAligned
};
inline constexpr int kLongestAligned = 1024;

enum class Isa { portable, avx2, avx512 };

/// The inner loops for one instruction set.
struct Kernels {
  void (*cast)(const CastJob& job, int first_block, int last_block);
  /// Voxels x_begin to x_end (excluded) of a row.
  void (*light)(const LightJob& job, int x_begin, int x_end, int y, int z);
  void (*warp)(const WarpJob& job, int x_begin, int x_end, int y, int z);
  /// The least and the greatest HU over all y and z of a box, for each of its x.
  void (*bounds)(const GridView& grid, int x_begin, int x_end, int y_begin, int y_end, int z_begin, int z_end, int* low,
                 int* high);
};

const Kernels& kernels_of(Isa isa);
/// Those that this machine can run, the fastest last.
std::vector<Isa> supported_isas();
std::string name_of(Isa isa);

const Kernels& portable_kernels();
const Kernels& avx2_kernels();
const Kernels& avx512_kernels();

}  // namespace birdseye::host::cpu
