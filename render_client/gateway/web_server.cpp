#include "render_client/gateway/web_server.h"

#include <libwebsockets.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"

namespace sectio {

namespace {

constexpr int kTick_us = 4000;
constexpr int kSendBufferBytes = 1 << 18;  // a slow client gets these late; the rest waits here, where the newest wins
constexpr int kTooLong = 1009;
constexpr std::size_t kMostWaiting = 64;  // for a picture
constexpr int kPatience_s = 20;           // likewise
constexpr std::size_t kHeaderBytes = 2048;

struct PageFile {
  const char* address;
  const char* name;
  const char* type;
};
constexpr std::array<PageFile, 7> kPageFiles{{{"/", "index.html", "text/html; charset=utf-8"},
                                              {"/page.css", "page.css", "text/css"},
                                              {"/page.js", "page.js", "text/javascript"},
                                              {"/headset.js", "headset.js", "text/javascript"},
                                              {"/tries.js", "tries.js", "text/javascript"},
                                              {"/sectio.js", "sectio.js", "text/javascript"},
                                              {"/sectio.wasm", "sectio.wasm", "application/wasm"}}};

struct Socket {
  std::uint64_t id = 0;
  lws* wsi = nullptr;
  std::vector<std::uint8_t> incoming;
};

}  // namespace

struct WebServer::State {
  struct Tick {
    lws_sorted_usec_list_t timer{};  // first: the timer's callback gets its address
    State* state = nullptr;
  };

  WebServerOptions options;
  WebServerHandlers handlers;
  WebServerCounts counts;
  std::array<lws_protocols, 3> protocols{};
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  Tick tick;
  bool running = true;
  std::uint64_t last_id = 0;
  std::map<lws*, Socket> sockets;
  std::map<std::uint64_t, lws*> by_id;
  std::map<lws*, std::string> bodies;     // answers that are under way
  std::map<lws*, std::uint64_t> waiting;  // for a picture with this number
  std::vector<std::uint8_t> frame, padded;

  ~State() {
    if (context) lws_context_destroy(context);
  }

  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size);
  static void on_timer(lws_sorted_usec_list_t* timer);

  int serve_http(lws* wsi, const std::string& address);
  int begin_body(lws* wsi, const char* type, const std::string& body);
  int send_body(lws* wsi);
  int wait_for_picture(lws* wsi);
  int refuse(lws* wsi, unsigned status);
  int confirm_version(lws* wsi);
  int open(lws* wsi);
  void close(lws* wsi);
  int receive(lws* wsi, const std::uint8_t* bytes, std::size_t size);
  int send(lws* wsi);
};

void WebServer::State::on_timer(lws_sorted_usec_list_t* timer) {
  State& state = *reinterpret_cast<Tick*>(timer)->state;
  state.running = state.handlers.tick() && state.running;
  for (const auto& [wsi, number] : state.waiting)
    if (state.handlers.picture(number)) lws_callback_on_writable(wsi);
  lws_sul_schedule(state.context, 0, timer, on_timer, kTick_us);
}

int WebServer::State::serve_http(lws* wsi, const std::string& address) {
  constexpr char kText[] = "text/plain; version=0.0.4";
  if (address == "/metrics") return begin_body(wsi, kText, handlers.metrics());
  if (address == "/version") return begin_body(wsi, kText, options.protocol + "\n");
  if (address == "/tries") return begin_body(wsi, "application/json", handlers.tries());
  if (address == "/frame.jpg") return wait_for_picture(wsi);
  for (const PageFile& file : kPageFiles) {
    if (address != file.address) continue;
    constexpr char kFresh[] = "Cache-Control: no-cache\r\n";
    const std::string path = options.directory + "/" + file.name;
    const int n = lws_serve_http_file(wsi, path.c_str(), file.type, kFresh, sizeof kFresh - 1);
    return n < 0 || (n > 0 && lws_http_transaction_completed(wsi)) ? -1 : 0;
  }
  return refuse(wsi, HTTP_STATUS_NOT_FOUND);
}

int WebServer::State::refuse(lws* wsi, unsigned status) {
  if (lws_return_http_status(wsi, status, nullptr)) return -1;
  return lws_http_transaction_completed(wsi) ? -1 : 0;
}

int WebServer::State::wait_for_picture(lws* wsi) {
  if (waiting.size() >= kMostWaiting) return refuse(wsi, HTTP_STATUS_SERVICE_UNAVAILABLE);
  waiting[wsi] = handlers.ask_picture();
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kPatience_s);
  return 0;
}

int WebServer::State::begin_body(lws* wsi, const char* type, const std::string& body) {
  std::array<unsigned char, LWS_PRE + kHeaderBytes> buffer;
  unsigned char *start = buffer.data() + LWS_PRE, *at = start, *end = buffer.data() + buffer.size();
  constexpr char kFresh[] = "no-store";
  if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, type, body.size(), &at, end) ||
      lws_add_http_header_by_token(wsi, WSI_TOKEN_HTTP_CACHE_CONTROL, reinterpret_cast<const unsigned char*>(kFresh),
                                   sizeof kFresh - 1, &at, end) ||
      lws_finalize_write_http_header(wsi, start, &at, end))
    return -1;
  bodies[wsi] = body;
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::State::send_body(lws* wsi) {
  if (const auto asked = waiting.find(wsi); asked != waiting.end()) {
    const std::shared_ptr<const std::string> picture = handlers.picture(asked->second);
    if (!picture) return 0;
    waiting.erase(asked);
    return begin_body(wsi, "image/jpeg", *picture);
  }
  const auto body = bodies.find(wsi);
  if (body == bodies.end()) return 0;
  padded.assign(LWS_PRE, 0);
  padded.insert(padded.end(), body->second.begin(), body->second.end());
  const std::size_t size = body->second.size();
  bodies.erase(body);
  if (lws_write(wsi, padded.data() + LWS_PRE, size, LWS_WRITE_HTTP_FINAL) < static_cast<int>(size)) return -1;
  return lws_http_transaction_completed(wsi) ? -1 : 0;
}

// A browser can't read the answer to a handshake that was refused: the page asks for /version then.
int WebServer::State::confirm_version(lws* wsi) {
  std::array<char, 128> asked{};
  lws_hdr_copy(wsi, asked.data(), static_cast<int>(asked.size()), WSI_TOKEN_PROTOCOL);
  if (options.protocol == asked.data()) return 0;
  ++counts.versions_refused;
  log_limited(LogLevel::warning, "version",
              "a page speaks '" + std::string(asked.data()) + "', this gateway '" + options.protocol +
                  "': it must be loaded again");
  const std::string text = "this gateway speaks " + options.protocol;
  if (lws_return_http_status(wsi, HTTP_STATUS_BAD_REQUEST, text.c_str())) return -1;
  return 1;
}

int WebServer::State::open(lws* wsi) {
  const std::uint64_t id = ++last_id;
  sockets[wsi] = {id, wsi, {}};
  by_id[id] = wsi;
  setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  if (handlers.opened(id)) return 0;
  sockets.erase(wsi);
  by_id.erase(id);
  return -1;
}

void WebServer::State::close(lws* wsi) {
  const auto socket = sockets.find(wsi);
  if (socket == sockets.end()) return;
  const std::uint64_t id = socket->second.id;
  sockets.erase(socket);
  by_id.erase(id);
  handlers.closed(id);
}

int WebServer::State::receive(lws* wsi, const std::uint8_t* bytes, std::size_t size) {
  const auto at = sockets.find(wsi);
  if (at == sockets.end()) return -1;
  Socket& socket = at->second;
  if (socket.incoming.size() + size + lws_remaining_packet_payload(wsi) > options.max_message_bytes) {
    ++counts.messages_too_long;
    lws_close_reason(wsi, static_cast<lws_close_status>(kTooLong), nullptr, 0);
    return -1;
  }
  socket.incoming.insert(socket.incoming.end(), bytes, bytes + size);
  if (!lws_is_final_fragment(wsi)) return 0;
  const std::vector<std::uint8_t> whole = std::exchange(socket.incoming, {});
  return handlers.received(socket.id, whole) ? 0 : -1;
}

// One frame for each time that the socket can take one.
int WebServer::State::send(lws* wsi) {
  const auto at = sockets.find(wsi);
  if (at == sockets.end() || !handlers.next_frame(at->second.id, frame)) return 0;
  padded.assign(LWS_PRE, 0);
  padded.insert(padded.end(), frame.begin(), frame.end());
  if (lws_write(wsi, padded.data() + LWS_PRE, frame.size(), LWS_WRITE_BINARY) < static_cast<int>(frame.size()))
    return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::State::callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  auto* state = wsi ? static_cast<State*>(lws_context_user(lws_get_context(wsi))) : nullptr;
  if (!state) return 0;
  switch (reason) {
    case LWS_CALLBACK_HTTP:
      return state->serve_http(wsi, static_cast<const char*>(in));
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return state->send_body(wsi);
    case LWS_CALLBACK_HTTP_FILE_COMPLETION:
      return lws_http_transaction_completed(wsi) ? -1 : 0;
    case LWS_CALLBACK_CLOSED_HTTP:
      state->bodies.erase(wsi);
      state->waiting.erase(wsi);
      return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return state->confirm_version(wsi);
    case LWS_CALLBACK_ESTABLISHED:
      return state->open(wsi);
    case LWS_CALLBACK_CLOSED:
      state->close(wsi);
      return 0;
    case LWS_CALLBACK_RECEIVE:
      return state->receive(wsi, static_cast<const std::uint8_t*>(in), size);
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return state->send(wsi);
    default:
      return 0;
  }
}

WebServer::WebServer(const WebServerOptions& options, WebServerHandlers handlers) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.options = options;
  s.handlers = std::move(handlers);
  for (const PageFile& file : kPageFiles)
    if (!std::filesystem::is_regular_file(options.directory + "/" + file.name))
      throw InputError("--page: " + options.directory + " has no " + file.name +
                       "; deploy/live makes the files of the page");
  s.protocols[0].name = "http";
  s.protocols[0].callback = State::callback;
  s.protocols[1] = s.protocols[0];
  s.protocols[1].name = s.options.protocol.c_str();
  s.protocols[1].rx_buffer_size = s.options.max_message_bytes;

  lws_set_log_level(LLL_ERR, [](int, const char* line) { log_limited(LogLevel::warning, "lws", line); });
  lws_context_creation_info info{};
  const bool everywhere = options.address == "0.0.0.0";
  info.port = options.port;
  info.iface = everywhere ? nullptr : s.options.address.c_str();
  info.protocols = s.protocols.data();
  info.user = &s;
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  info.options =
      LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  info.keepalive_timeout = info.timeout_secs = 5;
  info.pt_serv_buf_size = 1 << 15;
  s.context = lws_create_context(&info);
  if (s.context) s.vhost = lws_create_vhost(s.context, &info);
  if (!s.vhost || lws_get_vhost_listen_port(s.vhost) <= 0)
    throw InputError("--address, --port: can't listen on " + options.address + ":" + std::to_string(options.port));
  s.tick.state = &s;
}

WebServer::~WebServer() = default;

int WebServer::port() const {
  return lws_get_vhost_listen_port(state_->vhost);
}

void WebServer::run() {
  lws_sul_schedule(state_->context, 0, &state_->tick.timer, State::on_timer, 1);
  while (state_->running && lws_service(state_->context, 0) >= 0) {
  }
  lws_sul_cancel(&state_->tick.timer);
}

void WebServer::wants_to_send(std::uint64_t socket) {
  const auto at = state_->by_id.find(socket);
  if (at != state_->by_id.end()) lws_callback_on_writable(at->second);
}

const WebServerCounts& WebServer::counts() const {
  return state_->counts;
}

}  // namespace sectio
