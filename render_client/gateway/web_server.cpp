#include "render_client/gateway/web_server.h"

#include <libwebsockets.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"

namespace sectio {

namespace {

constexpr int kTick_us = 4000;
constexpr int kSendBufferBytes = 1 << 18;  // a slow client gets these late; the rest waits here, where the newest wins
constexpr unsigned kPolicyViolation = 1008, kCloseFrame = 0x88;  // RFC 6455
constexpr std::size_t kMaxReasonBytes = 123;
constexpr std::size_t kMostWaiting = 64;  // for a picture
constexpr int kPatience_s = 20;           // likewise
constexpr std::size_t kHeaderBytes = 2048;
constexpr double kPatienceToAsk_s = 10;      // for a request to be complete
constexpr double kPing_s = 5, kDeaf_s = 15;  // without a sign of life
constexpr double kPieces_per_s = 500;        // messages and their parts; a page sends one a picture
constexpr double kMaxPieces = 2000;          // beyond that rate
constexpr double kCheck_s = 0.25, kAsleep_s = 1;

struct PageFile {
  const char* address;
  const char* name;
  const char* type;
};
constexpr std::array<PageFile, 9> kPageFiles{{{"/", "index.html", "text/html; charset=utf-8"},
                                              {"/page.css", "page.css", "text/css"},
                                              {"/page.js", "page.js", "text/javascript"},
                                              {"/hand.js", "hand.js", "text/javascript"},
                                              {"/headset.js", "headset.js", "text/javascript"},
                                              {"/orders.js", "orders.js", "text/javascript"},
                                              {"/tries.js", "tries.js", "text/javascript"},
                                              {"/sectio.js", "sectio.js", "text/javascript"},
                                              {"/sectio.wasm", "sectio.wasm", "application/wasm"}}};

struct Socket {
  std::uint64_t id = 0;
  lws* wsi = nullptr;
  std::vector<std::uint8_t> incoming;
  double heard_s = 0, pinged_s = 0;
  double pieces = 0;     // how many have come of late
  bool is_full = false;  // it takes no more until the other side has read
};

struct Connection {
  double since_s = 0;  // it began, or the answer before has ended
  bool has_asked = false, is_cut = false;
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
  std::map<lws*, Connection> connections;  // also those that become sockets
  std::map<lws*, Socket> sockets;
  std::map<std::uint64_t, lws*> by_id;
  std::map<lws*, std::string> bodies;     // answers that are under way
  std::map<lws*, std::uint64_t> waiting;  // for a picture with this number
  std::vector<std::uint8_t> frame, padded;
  double checked_s = 0;

  ~State() {
    if (context) lws_context_destroy(context);
  }

  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size);
  static void on_timer(lws_sorted_usec_list_t* timer);

  void begin(lws* wsi);
  void check(double now_s);
  void cut(lws* wsi, const std::string& fault);
  void say_goodbye(lws* wsi, const std::string& fault);
  int complete(lws* wsi);
  int serve_http(lws* wsi, const std::string& address);
  int begin_body(lws* wsi, const char* type, const std::string& body);
  int send_body(lws* wsi);
  int wait_for_picture(lws* wsi);
  int refuse(lws* wsi, unsigned status);
  static bool is_of_another_site(lws* wsi);
  static int refuse_handshake(lws* wsi, unsigned status, const std::string& text);
  int confirm_handshake(lws* wsi);
  int open(lws* wsi);
  void close(lws* wsi);
  int receive(lws* wsi, const std::uint8_t* bytes, std::size_t size);
  bool hear(lws* wsi, Socket& socket);
  bool ping_if_due(lws* wsi, Socket& socket);
  int send(lws* wsi);
};

void WebServer::State::on_timer(lws_sorted_usec_list_t* timer) {
  State& state = *reinterpret_cast<Tick*>(timer)->state;
  state.running = state.handlers.tick() && state.running;
  for (const auto& [wsi, number] : state.waiting)
    if (state.handlers.picture(number)) lws_callback_on_writable(wsi);
  if (const double now_s = steady_now_s(); now_s - state.checked_s > kCheck_s) state.check(now_s);
  lws_sul_schedule(state.context, 0, timer, on_timer, kTick_us);
}

// A connection more. When there are too many, the oldest that has asked for nothing makes room.
void WebServer::State::begin(lws* wsi) {
  connections[wsi] = {steady_now_s()};
  const auto idle = [](const auto& each) { return !each.second.has_asked && !each.second.is_cut; };
  const auto here = std::ranges::count_if(connections, [](const auto& each) { return !each.second.is_cut; });
  if (static_cast<std::size_t>(here) <= options.max_connections) return;
  const std::string most = std::to_string(options.max_connections) + " connections";
  auto oldest = connections.end();
  for (auto at = connections.begin(); at != connections.end(); ++at)
    if (idle(*at) && (oldest == connections.end() || at->second.since_s < oldest->second.since_s)) oldest = at;
  cut(oldest->first, "is one of more than " + most);
}

// Ends what has been silent for too long.
void WebServer::State::check(double now_s) {
  const bool slept = now_s - checked_s > kAsleep_s;  // nobody could be heard
  checked_s = now_s;
  for (auto& [wsi, connection] : connections) {
    if (slept) connection.since_s = now_s;
    if (!connection.has_asked && !connection.is_cut && now_s - connection.since_s > kPatienceToAsk_s)
      cut(wsi, "has asked for nothing for 10 s");
  }
  for (auto& [wsi, socket] : sockets) {
    if (slept) socket.heard_s = now_s;
    if (now_s - socket.heard_s > kDeaf_s)
      cut(wsi, "has answered nothing for 15 s");
    else if (now_s - std::max(socket.heard_s, socket.pinged_s) > kPing_s)
      lws_callback_on_writable(wsi);
  }
}

void WebServer::State::cut(lws* wsi, const std::string& fault) {
  Connection& connection = connections[wsi];
  if (std::exchange(connection.is_cut, true)) return;
  ++counts.cut;
  const auto socket = sockets.find(wsi);
  if (socket != sockets.end()) say_goodbye(wsi, fault);
  const std::string who = socket == sockets.end() ? "a connection" : handlers.title(socket->second.id);
  log_limited(LogLevel::warning, fault, who + " is disconnected: it " + fault);
  lws_set_timeout(wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
}

// A frame of closing, if it can be said at once: whoever is cut isn't waited for, as libwebsockets would do.
void WebServer::State::say_goodbye(lws* wsi, const std::string& fault) {
  if (lws_partial_buffered(wsi)) return;
  const std::string reason = fault.substr(0, kMaxReasonBytes);
  const std::string head = {static_cast<char>(kCloseFrame), static_cast<char>(reason.size() + 2),
                            static_cast<char>(kPolicyViolation >> 8), static_cast<char>(kPolicyViolation & 0xff)};
  (void)::send(lws_get_socket_fd(wsi), (head + reason).data(), head.size() + reason.size(),
               MSG_DONTWAIT | MSG_NOSIGNAL);
}

// The answer is on its way: another request may follow.
int WebServer::State::complete(lws* wsi) {
  connections[wsi] = {steady_now_s()};
  return lws_http_transaction_completed(wsi) ? -1 : 0;
}

int WebServer::State::serve_http(lws* wsi, const std::string& address) {
  connections[wsi].has_asked = true;
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) == 0) {  // and no body is read
    (void)lws_return_http_status(wsi, HTTP_STATUS_METHOD_NOT_ALLOWED, nullptr);
    return -1;
  }
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
    return n < 0 || (n > 0 && complete(wsi) < 0) ? -1 : 0;
  }
  return refuse(wsi, HTTP_STATUS_NOT_FOUND);
}

int WebServer::State::refuse(lws* wsi, unsigned status) {
  if (lws_return_http_status(wsi, status, nullptr)) return -1;
  return complete(wsi);
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
  return complete(wsi);
}

// A page of another site that a browser here has open must not watch; programs other than browsers name no origin.
bool WebServer::State::is_of_another_site(lws* wsi) {
  std::array<char, 256> origin{}, host{};
  if (lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) == 0) return false;
  if (lws_hdr_copy(wsi, origin.data(), static_cast<int>(origin.size()), WSI_TOKEN_ORIGIN) < 0 ||
      lws_hdr_copy(wsi, host.data(), static_cast<int>(host.size()), WSI_TOKEN_HOST) < 0)
    return true;
  const std::string_view of(origin.data());
  const std::size_t scheme = of.find("://");
  return scheme == of.npos || of.substr(scheme + 3) != host.data();
}

// A browser can't read the answer to a handshake that was refused: the page asks for /version then.
int WebServer::State::refuse_handshake(lws* wsi, unsigned status, const std::string& text) {
  return lws_return_http_status(wsi, status, text.c_str()) != 0 ? -1 : 1;
}

int WebServer::State::confirm_handshake(lws* wsi) {
  if (is_of_another_site(wsi)) {
    log_limited(LogLevel::warning, "origin", "a page of another site is refused");
    return refuse_handshake(wsi, HTTP_STATUS_FORBIDDEN, "pages of other sites are refused");
  }
  std::array<char, 128> asked{};
  lws_hdr_copy(wsi, asked.data(), static_cast<int>(asked.size()), WSI_TOKEN_PROTOCOL);
  if (options.protocol == asked.data()) return 0;
  ++counts.versions_refused;
  log_limited(LogLevel::warning, "version",
              "a page speaks '" + std::string(asked.data()) + "', this gateway '" + options.protocol +
                  "': it must be loaded again");
  return refuse_handshake(wsi, HTTP_STATUS_BAD_REQUEST, "this gateway speaks " + options.protocol);
}

int WebServer::State::open(lws* wsi) {
  const std::uint64_t id = ++last_id;
  const double now_s = steady_now_s();
  connections[wsi].has_asked = true;
  sockets[wsi] = {id, wsi, {}, now_s, now_s};
  by_id[id] = wsi;
  setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  if (handlers.opened(id)) return 0;
  log_limited(LogLevel::warning, "full", "a browser is refused: there are as many as --max-clients allows");
  say_goodbye(wsi, "is one too many: as many are here as --max-clients allows");
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

// A piece of a message has come, or another sign of life. False: there are too many.
bool WebServer::State::hear(lws* wsi, Socket& socket) {
  const double now_s = steady_now_s();
  socket.pieces = std::max(0.0, socket.pieces - kPieces_per_s * (now_s - socket.heard_s)) + 1;
  socket.heard_s = now_s;
  if (connections[wsi].is_cut) return false;
  if (socket.pieces <= kMaxPieces) return true;
  cut(wsi, "sends more than 500 messages a second");
  return false;
}

int WebServer::State::receive(lws* wsi, const std::uint8_t* bytes, std::size_t size) {
  const auto at = sockets.find(wsi);
  if (at == sockets.end()) return -1;
  Socket& socket = at->second;
  if (!hear(wsi, socket)) return 0;
  if (socket.incoming.size() + size + lws_remaining_packet_payload(wsi) > options.max_message_bytes) {
    ++counts.messages_too_long;
    cut(wsi, "has sent a message of more than " + std::to_string(options.max_message_bytes) + " bytes");
    return 0;
  }
  socket.incoming.insert(socket.incoming.end(), bytes, bytes + size);
  if (!lws_is_final_fragment(wsi)) return 0;
  const std::vector<std::uint8_t> whole = std::exchange(socket.incoming, {});
  handlers.received(socket.id, whole);
  return 0;
}

bool WebServer::State::ping_if_due(lws* wsi, Socket& socket) {
  const double now_s = steady_now_s();
  if (now_s - std::max(socket.heard_s, socket.pinged_s) <= kPing_s) return false;
  socket.pinged_s = now_s;
  padded.assign(LWS_PRE + 1, 'p');  // libwebsockets says nothing of the answer to an empty ping
  lws_write(wsi, padded.data() + LWS_PRE, 1, LWS_WRITE_PING);
  lws_callback_on_writable(wsi);
  return true;
}

// One frame for each time that the socket can take one.
int WebServer::State::send(lws* wsi) {
  const auto at = sockets.find(wsi);
  // A client that reads is alive, though the answer to a ping comes late: the ping waits behind all that is to be read.
  if (at != sockets.end() && std::exchange(at->second.is_full, false)) at->second.heard_s = steady_now_s();
  if (at != sockets.end() && ping_if_due(wsi, at->second)) return 0;
  if (at == sockets.end() || !handlers.next_frame(at->second.id, frame)) return 0;
  padded.assign(LWS_PRE, 0);
  padded.insert(padded.end(), frame.begin(), frame.end());
  if (lws_write(wsi, padded.data() + LWS_PRE, frame.size(), LWS_WRITE_BINARY) < static_cast<int>(frame.size()))
    return -1;
  at->second.is_full = lws_send_pipe_choked(wsi) != 0;
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::State::callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  auto* state = wsi ? static_cast<State*>(lws_context_user(lws_get_context(wsi))) : nullptr;
  if (!state) return 0;
  switch (reason) {
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      state->begin(wsi);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      state->connections.erase(wsi);
      return 0;
    case LWS_CALLBACK_HTTP:
      return state->serve_http(wsi, static_cast<const char*>(in));
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return state->send_body(wsi);
    case LWS_CALLBACK_HTTP_FILE_COMPLETION:
      return state->complete(wsi);
    case LWS_CALLBACK_CLOSED_HTTP:
      state->bodies.erase(wsi);
      state->waiting.erase(wsi);
      return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return state->confirm_handshake(wsi);
    case LWS_CALLBACK_ESTABLISHED:
      return state->open(wsi);
    case LWS_CALLBACK_CLOSED:
      state->close(wsi);
      return 0;
    case LWS_CALLBACK_RECEIVE:
      return state->receive(wsi, static_cast<const std::uint8_t*>(in), size);
    case LWS_CALLBACK_RECEIVE_PONG:
      (void)state->hear(wsi, state->sockets[wsi]);
      return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return state->send(wsi);
    default:
      return 0;
  }
}

void check_page(const std::string& directory) {
  for (const PageFile& file : kPageFiles)
    if (!std::filesystem::is_regular_file(directory + "/" + file.name))
      throw InputError("--page: " + directory + " has no " + file.name +
                       "; deploy/live makes the files of the page, and a package has them");
}

WebServer::WebServer(const WebServerOptions& options, WebServerHandlers handlers) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.options = options;
  s.handlers = std::move(handlers);
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
  info.max_http_header_data = 1 << 15;  // cookies of a host are sent to all its ports, whoever has set them
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

void WebServer::cut(std::uint64_t socket, const std::string& fault) {
  const auto at = state_->by_id.find(socket);
  if (at != state_->by_id.end()) state_->cut(at->second, fault);
}

const WebServerCounts& WebServer::counts() const {
  return state_->counts;
}

}  // namespace sectio
