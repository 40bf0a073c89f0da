#include "device_bridge/drivers/tracker.h"

#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>
#include <igtlTransformMessage.h>

#include <chrono>
#include <thread>

#include "common/core/error.h"
#include "device_bridge/drivers/polled_handle.h"
#include "device_bridge/drivers/port_probe.h"

namespace sectio {
namespace {

constexpr int kReceive_ms = 100;
constexpr std::chrono::milliseconds kReconnect{500}, kLook{10};
constexpr double kFirstPlace_s = 5;
constexpr int kLongestBody_bytes = 1 << 20;

class Tracker : public PolledHandle {
 public:
  explicit Tracker(const TrackerSpec& spec) : spec_(spec), socket_(igtl::ClientSocket::New()) {
    if (!connect()) throw InputError("--device tracker: no server of OpenIGTLink answers at " + address());
    thread_ = std::thread([this] { run(); });
    const double end_s = steady_now_s() + kFirstPlace_s;
    while (lost() && steady_now_s() < end_s) std::this_thread::sleep_for(kLook);
    if (!lost()) return;
    stop();
    throw InputError("--device tracker: the server at " + address() + " tells no place" +
                     (spec_.name.empty() ? "" : " of '" + spec_.name + "'"));
  }
  ~Tracker() override { stop(); }

 private:
  std::string address() const { return spec_.host + ":" + std::to_string(spec_.port); }

  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    socket_->CloseSocket();
  }
  // The library prints lines of its own when nobody listens.
  bool connect() {
    if (!listens_at(spec_.host, spec_.port)) return false;
    if (socket_->ConnectToServer(spec_.host.c_str(), spec_.port) != 0) return false;
    socket_->SetReceiveTimeout(kReceive_ms);
    return true;
  }
  void run() {
    while (!stop_) {
      if (socket_->GetConnected() && hear()) continue;
      socket_->CloseSocket();
      std::this_thread::sleep_for(kReconnect);
      if (!stop_) connect();
    }
  }

  // False when the connection has ended, or speaks another language.
  bool hear() {
    const igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    const int size = socket_->Receive(header->GetPackPointer(), header->GetPackSize());
    if (size < 0) return true;  // nothing has come for a while
    if (size != static_cast<int>(header->GetPackSize())) return false;
    header->Unpack();
    if (header->GetBodySizeToRead() > kLongestBody_bytes) return false;
    const bool is_ours = spec_.name.empty() || spec_.name == header->GetDeviceName();
    if (!is_ours || std::string(header->GetDeviceType()) != "TRANSFORM")
      return socket_->Skip(static_cast<int>(header->GetBodySizeToRead()), 0) >= 0;
    if (spec_.name.empty()) spec_.name = header->GetDeviceName();
    const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    if (socket_->Receive(message->GetPackBodyPointer(), message->GetPackBodySize()) <= 0) return false;
    if (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) take(*message);
    return true;
  }
  // Messages are in millimetres.
  void take(igtl::TransformMessage& message) {
    igtl::Matrix4x4 place;
    message.GetMatrix(place);
    Mat3 turned;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) turned(i, k) = static_cast<double>(place[i][k]);
    HandleState state;
    for (int i = 0; i < 3; ++i) state.pose.position_m[i] = 0.001 * static_cast<double>(place[i][3]);
    if (!turned.allFinite() || !state.pose.position_m.allFinite() || turned.determinant() < 0.5) return;
    state.pose.orientation = Eigen::Quaterniond(turned).normalized();
    heard(state);
  }

  TrackerSpec spec_;
  igtl::ClientSocket::Pointer socket_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Handle> open_tracker(const TrackerSpec& spec) {
  return std::make_unique<Tracker>(spec);
}

}  // namespace sectio
