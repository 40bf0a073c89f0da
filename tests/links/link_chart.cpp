// Runs sessions behind links of several kinds, and prints a row of a table for each.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <utility>

#include "common/core/formatted.h"
#include "tests/support/linked_session.h"

namespace sectio::test {
namespace {

constexpr double kMbit = 1e6;

std::vector<std::pair<std::string, LinkedSession>> cases() {
  const HostLinks free = {};
  const auto behind = [](double mbit_per_s) { return HostLinks{.down = {.rate_bit_per_s = mbit_per_s * kMbit}}; };
  const HostLinks lossy{.down = {.rate_bit_per_s = 5 * kMbit, .loss = 0.02}};
  LinkedSession shared{.server = {.up = {.rate_bit_per_s = 100 * kMbit}}, .viewers = {behind(5), free, free}};
  return {
      {"free", {.viewers = {free}}},
      {"free, with keys", {.secured = true, .viewers = {free}}},
      {"12 Mbit/s", {.viewers = {behind(12)}}},
      {"5 Mbit/s", {.viewers = {behind(5)}}},
      {"5 Mbit/s, with keys", {.secured = true, .viewers = {behind(5)}}},
      {"5 Mbit/s, loss 2 %", {.viewers = {lossy}}},
      {"5 Mbit/s, loss 2 %, with keys", {.secured = true, .viewers = {lossy}}},
      {"1 Mbit/s", {.viewers = {behind(1)}}},
      {"50 Mbit/s, 154 880 triangles", {.finer = 2, .duration_s = 6.5, .viewers = {behind(50)}}},
      {"5 Mbit/s, hand and viewer behind one uplink",
       {.server = {.up = {.rate_bit_per_s = 5 * kMbit}}, .viewers = {free}}},
      {"one of three at 5 Mbit/s, uplink of 100", shared},
      {"loss 5 %, 5 ± 2 ms", {.viewers = {{.down = {.delay_s = 0.005, .jitter_s = 0.002, .loss = 0.05}}}}},
      {"25 ± 10 ms, out of order", {.viewers = {{.down = {.delay_s = 0.025, .jitter_s = 0.010, .reorders = true}}}}},
      {"late join of a second viewer", {.viewers = {free, free}, .late_s = 3}},
  };
}

void print_row(const std::string& name, const SessionFigures& f) {
  std::string states, equal, first;
  for (const ViewerFigures& v : f.viewers) {
    states += (states.empty() ? "" : ", ") + std::to_string(v.states);
    equal += (equal.empty() ? "" : ", ") + v.equals_server;
    first += formatted("%s%.1f", first.empty() ? "" : ", ", v.first_state_s);
  }
  std::printf("| %s | %.1f | %llu | %s | %s | %s | %.1f | %.1f | %.1f |\n", name.c_str(),
              static_cast<double>(f.offered.bytes) / 1e6, static_cast<unsigned long long>(f.dropped), states.c_str(),
              equal.c_str(), first.c_str(), 1e3 * f.model_age_median_s, 1e3 * f.model_age_p99_s,
              1e3 * f.model_age_max_s);
  std::fflush(stdout);
  if (!f.trouble.empty()) std::fprintf(stderr, "%s\n", f.trouble.c_str());
}

// usage: link_chart [TEXT [BIN]]: links whose names hold TEXT (default: all), with the programs of the directory BIN.
int chart(int argc, char** argv) {
  const std::string wanted = argc > 1 ? argv[1] : "";
  const auto directory = std::filesystem::temp_directory_path() / ("sectio_links_" + std::to_string(getpid()));
  std::puts(
      "| link of the viewer | offered, MB | dropped | states | equal | first picture, s | age of the model, ms | p99 | "
      "most |\n|---|---|---|---|---|---|---|---|---|");
  for (auto& [name, session] : cases()) {
    if (name.find(wanted) == std::string::npos) continue;
    LinkedSession own = session;
    if (argc > 2) own.bin = argv[2];
    print_row(name, run(own, directory));
    std::filesystem::remove_all(directory);
  }
  return 0;
}

}  // namespace
}  // namespace sectio::test

int main(int argc, char** argv) {
  try {
    return sectio::test::chart(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "link_chart: %s\n", error.what());
    return 1;
  }
}
