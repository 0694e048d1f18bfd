// Prints poses and pictures as an OpenIGTLink server sends them: poses [HOST [PORT [COUNT]]]. Ends after COUNT poses.
// The same as poses.py, by libopenigtlink.
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

/// Reads the body that follows a header into a message. False where it is damaged or the server has gone.
template <typename Message>
bool read_body(igtl::ClientSocket& socket, igtl::MessageHeader& header, Message& message) {
  message.SetMessageHeader(&header);
  message.AllocatePack();
  const auto size = static_cast<int>(message.GetPackBodySize());
  if (socket.Receive(message.GetPackBodyPointer(), size) != size) return false;
  return (message.Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0;  // 1: with its checksum
}

double seconds_of(igtl::MessageHeader& header) {
  igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
  header.GetTimeStamp(stamp);
  return stamp->GetTimeStamp();
}

}  // namespace

int main(int argc, char** argv) {
  const char* const host = argc > 1 ? argv[1] : "127.0.0.1";
  const int port = argc > 2 ? std::atoi(argv[2]) : 18944;
  int left = argc > 3 ? std::atoi(argv[3]) : 20;
  const auto socket = igtl::ClientSocket::New();
  if (socket->ConnectToServer(host, port) != 0) {
    std::fprintf(stderr, "poses: nobody answers at %s:%d\n", host, port);
    return 1;
  }
  while (left > 0) {
    const auto header = igtl::MessageHeader::New();
    header->InitPack();
    const auto size = static_cast<int>(header->GetPackSize());
    if (socket->Receive(header->GetPackPointer(), size) != size) break;
    header->Unpack();
    const std::string kind = header->GetDeviceType();
    const std::string name = header->GetDeviceName();
    const double time = seconds_of(*header);
    if (kind == "TRANSFORM") {
      const auto transform = igtl::TransformMessage::New();
      if (!read_body(*socket, *header, *transform)) break;
      igtl::Matrix4x4 matrix;
      transform->GetMatrix(matrix);
      std::printf("%-20s %14.6f s  %8.2f %8.2f %8.2f mm\n", name.c_str(), time, static_cast<double>(matrix[0][3]),
                  static_cast<double>(matrix[1][3]), static_cast<double>(matrix[2][3]));
      --left;
    } else if (kind == "IMAGE") {
      const auto image = igtl::ImageMessage::New();
      if (!read_body(*socket, *header, *image)) break;
      int width = 0, height = 0, slices = 0;
      image->GetDimensions(width, height, slices);
      std::printf("%-20s %14.6f s  %d x %d, %d components\n", name.c_str(), time, width, height,
                  image->GetNumComponents());
    } else if (kind == "STATUS") {
      const auto status = igtl::StatusMessage::New();
      if (!read_body(*socket, *header, *status)) break;
      const bool ok = status->GetCode() == igtl::StatusMessage::STATUS_OK;
      std::printf("%-20s %s\n", name.c_str(), ok ? "OK" : status->GetStatusString());
    } else {
      socket->Skip(static_cast<int>(header->GetBodySizeToRead()));
    }
    std::fflush(stdout);
  }
  if (left > 0) std::fprintf(stderr, "poses: the server has gone, or sent a damaged message\n");
  return left > 0 ? 1 : 0;
}
