#include "tests/watchers/socket.h"

#include <libwebsockets.h>

#include <array>
#include <deque>
#include <string>

#include "common/core/error.h"
#include "common/messages/live.h"

namespace sectio::watchers {
namespace {

struct Socket {
  lws* wsi = nullptr;
  bool is_open = false;
  std::vector<std::uint8_t> incoming;
  std::deque<std::vector<std::uint8_t>> outgoing;
};

}  // namespace

struct Sockets::State {
  struct Wake {
    lws_sorted_usec_list_t list{};  // first: the callback gets its address
    State* state = nullptr;
  };
  static constexpr lws_usec_t kWake_us = 1000;

  std::string protocol = live_protocol();
  std::array<lws_protocols, 2> protocols{};
  lws_context* context = nullptr;
  std::vector<Socket> sockets;
  Heard heard;
  Wake wake;

  static void on_wake(lws_sorted_usec_list_t* list) {
    lws_sul_schedule(reinterpret_cast<Wake*>(list)->state->context, 0, list, on_wake, kWake_us);
  }

  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
    auto* state = wsi ? static_cast<State*>(lws_context_user(lws_get_context(wsi))) : nullptr;
    auto* socket = state ? static_cast<Socket*>(lws_get_opaque_user_data(wsi)) : nullptr;
    if (!socket) return 0;
    switch (reason) {
      case LWS_CALLBACK_CLIENT_ESTABLISHED:
        socket->is_open = true;
        lws_callback_on_writable(wsi);
        return 0;
      case LWS_CALLBACK_CLIENT_RECEIVE: {
        const auto* bytes = static_cast<const std::uint8_t*>(in);
        socket->incoming.insert(socket->incoming.end(), bytes, bytes + size);
        if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
        state->heard(static_cast<std::size_t>(socket - state->sockets.data()), socket->incoming);
        socket->incoming.clear();
        return 0;
      }
      case LWS_CALLBACK_CLIENT_WRITEABLE: {
        if (socket->outgoing.empty()) return 0;
        const std::vector<std::uint8_t>& frame = socket->outgoing.front();
        std::vector<unsigned char> padded(LWS_PRE + frame.size());
        std::copy(frame.begin(), frame.end(), padded.begin() + LWS_PRE);
        const int size_sent = lws_write(wsi, padded.data() + LWS_PRE, frame.size(), LWS_WRITE_BINARY);
        if (size_sent < static_cast<int>(frame.size())) return -1;
        socket->outgoing.pop_front();
        if (!socket->outgoing.empty()) lws_callback_on_writable(wsi);
        return 0;
      }
      case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
      case LWS_CALLBACK_CLIENT_CLOSED:
        socket->is_open = false;
        socket->wsi = nullptr;
        return 0;
      default:
        return 0;
    }
  }
};

Sockets::Sockets(int port, std::size_t count, Heard heard) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.heard = std::move(heard);
  s.sockets.resize(count);
  s.protocols[0].name = s.protocol.c_str();
  s.protocols[0].callback = State::callback;
  s.protocols[0].rx_buffer_size = 1 << 17;
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = s.protocols.data();
  info.user = &s;
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6;
  info.pt_serv_buf_size = 1 << 17;
  s.context = lws_create_context(&info);
  if (!s.context) throw InputError("libwebsockets can't be started");
  s.wake.state = &s;
  State::on_wake(&s.wake.list);
  for (Socket& socket : s.sockets) {
    lws_client_connect_info connect{};
    connect.context = s.context;
    connect.address = connect.host = connect.origin = "127.0.0.1";
    connect.port = port;
    connect.path = "/";
    connect.protocol = s.protocol.c_str();
    connect.opaque_user_data = &socket;
    connect.pwsi = &socket.wsi;
    lws_client_connect_via_info(&connect);
  }
}

Sockets::~Sockets() {
  lws_context_destroy(state_->context);
}

void Sockets::send(std::size_t socket, std::vector<std::uint8_t> frame) {
  Socket& s = state_->sockets[socket];
  s.outgoing.push_back(std::move(frame));
  if (s.wsi && s.is_open) lws_callback_on_writable(s.wsi);
}

void Sockets::run_once() {
  lws_service(state_->context, 0);
}

std::size_t Sockets::open() const {
  std::size_t count = 0;
  for (const Socket& socket : state_->sockets) count += socket.is_open ? 1 : 0;
  return count;
}

}  // namespace sectio::watchers
