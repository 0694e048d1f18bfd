#include "drivers/video/jpeg_decoder.hpp"

#include <csetjmp>
#include <cstddef>
#include <cstdio>  // for jpeglib.h, which does not include it itself

#include <jpeglib.h>

#include <jerror.h>

namespace birdseye::drivers {

namespace {

constexpr int kMostPadding = 16;

/// libjpeg's own handler ends the program and prints. This one comes back to where decoding began.
struct ErrorHandler {
  jpeg_error_mgr manager;  // first: libjpeg knows only this part
  std::jmp_buf back;
};

[[noreturn]] void leave(j_common_ptr common) {
  std::longjmp(reinterpret_cast<ErrorHandler*>(common->err)->back, 1);  // NOLINT(bugprone-*): libjpeg's own convention
}
/// Some cameras pad the end of a frame with a few bytes, which harm nothing.
bool is_padding(const jpeg_error_mgr& error) {
  return error.msg_code == JWRN_EXTRANEOUS_DATA && error.msg_parm.i[0] <= kMostPadding &&
         error.msg_parm.i[1] == JPEG_EOI;
}
/// level -1: a warning of damaged data, after which the picture goes on with rubbish. That is damage enough.
void heed(j_common_ptr common, int level) {
  if (level < 0 && !is_padding(*common->err)) leave(common);
}

struct Target {
  JDIMENSION width, height;
  std::uint8_t* rgb;
};

/// Nothing here has a destructor: the handler jumps over them.
bool decode(const std::uint8_t* bytes, std::size_t size, const Target& target) {
  jpeg_decompress_struct jpeg;
  ErrorHandler handler;
  jpeg.err = jpeg_std_error(&handler.manager);
  handler.manager.error_exit = leave;
  handler.manager.emit_message = heed;
  if (setjmp(handler.back) != 0) {  // NOLINT(bugprone-*): the same
    jpeg_destroy_decompress(&jpeg);
    return false;
  }
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, bytes, size);
  jpeg_read_header(&jpeg, TRUE);
  const bool right = jpeg.image_width == target.width && jpeg.image_height == target.height &&
                     jpeg.progressive_mode == FALSE && (jpeg.num_components == 3 || jpeg.num_components == 1);
  if (right) {
    jpeg.out_color_space = JCS_RGB;
    jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) {
      JSAMPROW row = target.rgb + std::size_t{jpeg.output_scanline} * target.width * 3;
      jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
  }
  jpeg_destroy_decompress(&jpeg);
  return right;
}

}  // namespace

bool decode_jpeg(std::span<const std::uint8_t> jpeg, int width_px, int height_px, std::vector<std::uint8_t>& rgb) {
  rgb.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
  return decode(jpeg.data(), jpeg.size(),
                {static_cast<JDIMENSION>(width_px), static_cast<JDIMENSION>(height_px), rgb.data()});
}

}  // namespace birdseye::drivers
