// The gateway: lets browsers take part in a session. One thread.
#include <arpa/inet.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <random>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/own_directory.h"
#include "common/core/stop_signal.h"
#include "common/core/unique_id.h"
#include "common/core/wall_time.h"
#include "common/dds/find_session.h"
#include "common/dds/network_arguments.h"
#include "render_client/gateway/gateway_net.h"
#include "render_client/gateway/web_server.h"
#include "render_client/stills/still_maker.h"

namespace sectio {
namespace {

struct Options {
  NetworkOptions network;
  WebServerOptions web;
  GatewayLimits limits;
  std::string token, lead_token, tries;
  std::uint32_t max_clients = 64;
};

// The page that a package has; empty: this program was not installed with one.
std::string installed_page() {
  std::error_code unknown;
  const std::filesystem::path page = own_directory().parent_path() / "share/sectio/page";
  return std::filesystem::is_directory(page, unknown) ? page.string() : "";
}

bool parse(int argc, char** argv, Options& o) {
  Arguments arguments("gateway", "Lets browsers watch a session, and hold its instruments.");
  add_network_arguments(arguments, o.network, "session to show; empty: the only one of the domain");
  o.web.directory = installed_page();
  arguments.option("--page", o.web.directory, "directory with the files of the page",
                   o.web.directory.empty() ? Need::required : Need::optional);
  arguments.option("--address", o.web.address, "IPv4 address to listen on; 0.0.0.0: all of this host");
  arguments.option("--port", o.web.port, "port to listen on; 0: any that is free");
  arguments.option("--token", o.token, "word that a person needs to hold an instrument; empty: a new one is made");
  arguments.option(
      "--lead-token", o.lead_token,
      "word that a person needs to pause, tilt and begin anew; empty: everyone who may hold an instrument");
  arguments.option("--tries", o.tries, "directory in which scored tries of an exercise are kept, for all later ones");
  arguments.option("--max-clients", o.max_clients, "browsers at a time; further ones are refused");
  if (!arguments.parse(argc, argv)) return false;
  if (o.web.port < 0 || o.web.port > 65535)
    throw InputError("--port: expected 0 to 65535, got " + std::to_string(o.web.port));
  if (o.max_clients < 1 || o.max_clients > kMaxPeople)
    throw InputError("--max-clients: expected 1 to " + std::to_string(kMaxPeople) + ", got " +
                     std::to_string(o.max_clients));
  for (const auto& [flag, token] : {std::pair("--token", o.token), std::pair("--lead-token", o.lead_token)})
    if (token.size() > kMaxTokenBytes || token.find_first_of("#/?&% ") != std::string::npos)
      throw InputError(std::string(flag) + ": expected at most " + std::to_string(kMaxTokenBytes) +
                       " characters without #/?&% or blanks");
  check_page(o.web.directory);
  if (std::error_code unknown;
      std::filesystem::exists(o.tries, unknown) && !std::filesystem::is_directory(o.tries, unknown))
    throw InputError("--tries: " + o.tries + ": is no directory");
  if (in_addr ignored; inet_pton(AF_INET, o.web.address.c_str(), &ignored) != 1)
    throw InputError("--address: expected an IPv4 address, got " + o.web.address);
  check_network_options(o.network);
  return true;
}

std::string new_token() {
  std::random_device chance;
  std::string token;
  constexpr char kLetters[] = "abcdefghjkmnpqrstuvwxyz23456789";
  for (int i = 0; i < 16; ++i) token += kLetters[chance() % (sizeof kLetters - 1)];
  return token;
}

constexpr double kForEver_s = 1e9;
constexpr std::size_t kConnectionsBesides = 192;  // for the files of the page, pictures and counts
constexpr double kFarewell_s = 0.5;               // for the session's end to reach browsers

// Draws for browsers that can't; from the first one that asks until a while after the last.
class Stills {
 public:
  explicit Stills(Gateway& gateway) : gateway_(gateway) {}

  std::uint64_t ask(double now_s) {
    asked_s_ = now_s;
    if (!maker_) {
      maker_.emplace(kStillWidth_px, kStillHeight_px);
      client_ = gateway_.connect_inside();
    }
    return maker_->ask();
  }
  std::shared_ptr<const std::string> picture(std::uint64_t number) const {
    const std::shared_ptr<const Still> newest = maker_ ? maker_->newest() : nullptr;
    if (!newest || newest->number < number) return nullptr;
    return {newest, &newest->jpeg};
  }
  void tick(double now_s) {
    if (!maker_) return;
    std::vector<std::uint8_t> frame;
    while (maker_->has_room() && gateway_.next_frame(client_, frame)) maker_->feed(std::move(frame));
    const std::vector<std::uint8_t> answer = maker_->take_outgoing();
    if (!answer.empty()) gateway_.receive(client_, answer, now_s);
    if (now_s - asked_s_ < kNobodyAsks_s) return;
    maker_.reset();
    gateway_.disconnect(client_);
  }

 private:
  static constexpr int kStillWidth_px = 960, kStillHeight_px = 540;
  static constexpr double kNobodyAsks_s = 30;

  Gateway& gateway_;
  std::optional<StillMaker> maker_;
  std::uint32_t client_ = 0;
  double asked_s_ = 0;
};

// Passes messages between sockets, people and the session. One thread.
class Doorway {
 public:
  explicit Doorway(const Options& o)
      : gateway_({o.token, o.lead_token}, o.limits, unique_id(kProgramIdBits)), net_(o.network) {
    gateway_.tries().keep_in(o.tries);
  }

  // Returns when the session has ended, or a signal has come.
  void serve(const Options& o) {
    WebServer web(o.web, handlers());
    server_ = &web;
    std::printf("http://%s:%d/#%s\n", o.web.address.c_str(), web.port(), o.token.c_str());
    std::fflush(stdout);
    web.run();
    server_ = nullptr;
  }

 private:
  WebServerHandlers handlers() {
    WebServerHandlers h;
    h.opened = [this](std::uint64_t socket) {
      const auto client = gateway_.connect();
      if (client) client_of_[socket] = *client;
      return client.has_value();
    };
    h.closed = [this](std::uint64_t socket) {
      gateway_.disconnect(client_of_[socket]);
      client_of_.erase(socket);
    };
    h.received = [this](std::uint64_t socket, const std::vector<std::uint8_t>& frame) {
      gateway_.receive(client_of_[socket], frame, steady_now_s());
      cut_guilty();
      net_.send(gateway_, steady_now_s());  // a wish waits for nothing
    };
    h.next_frame = [this](std::uint64_t socket, std::vector<std::uint8_t>& frame) {
      return gateway_.next_frame(client_of_[socket], frame);
    };
    h.title = [this](std::uint64_t socket) { return gateway_.title(client_of_[socket]); };
    h.metrics = [this] { return metrics(); };
    h.tries = [this] { return gateway_.tries().json(); };
    h.ask_picture = [this] { return stills_.ask(steady_now_s()); };
    h.picture = [this](std::uint64_t number) { return stills_.picture(number); };
    h.tick = [this] { return tick(steady_now_s()); };
    return h;
  }

  void cut_guilty() {
    for (const auto& [client, fault] : gateway_.take_guilty())
      for (const auto& [socket, person] : client_of_)
        if (person == client) server_->cut(socket, fault);
  }
  std::string metrics() const {
    const auto line = [](const char* name, std::uint64_t value) {
      const std::string full = std::string("sectio_gateway_") + name + "_total";
      return "# TYPE " + full + " counter\n" + full + " " + std::to_string(value) + "\n";
    };
    return gateway_.metrics() + line("refused_versions", server_->counts().versions_refused) +
           line("cut_connections", server_->counts().cut) +
           line("refused_long_messages", server_->counts().messages_too_long);
  }
  // False: the end.
  bool tick(double now_s) {
    net_.poll(gateway_);
    gateway_.tick(now_s);
    cut_guilty();
    stills_.tick(now_s);
    net_.send(gateway_, now_s);
    for (const auto& [socket, client] : client_of_)
      if (gateway_.has_mail(client)) server_->wants_to_send(socket);
    if (net_.session_ended() && stop_s_ == kForEver_s) {
      log_info("the session has ended");
      stop_s_ = now_s + kFarewell_s;
    }
    return !stop_was_requested() && now_s < stop_s_;
  }

  Gateway gateway_;
  GatewayNet net_;
  Stills stills_{gateway_};
  std::map<std::uint64_t, std::uint32_t> client_of_;  // by socket
  double stop_s_ = kForEver_s;
  WebServer* server_ = nullptr;  // while it serves
};

int run(Options& o) {
  catch_stop_signals();
  if (o.token.empty()) o.token = new_token();
  o.limits.max_clients = o.max_clients;
  o.web.protocol = live_protocol();
  o.web.max_connections = o.max_clients + kConnectionsBesides;
  o.web.max_message_bytes = Gateway::kMaxMessageBytes;
  if (!find_session(o.network, kForEver_s, stop_was_requested)) return 1;
  Doorway(o).serve(o);
  return 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("gateway", [&] {
    sectio::Options options;
    return sectio::parse(argc, argv, options) ? sectio::run(options) : 0;
  });
}
