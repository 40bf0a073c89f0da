#include "common/messages/link.h"

#include <algorithm>

#include "common/core/formatted.h"
#include "common/core/report_figures.h"

namespace sectio {
namespace {

std::string milliseconds(double seconds) {
  return formatted("%.1f ms", 1e3 * seconds);
}

}  // namespace

std::string line_of(const LinkReport& r) {
  const bool hand = r.kind == ProgramKind::hand;
  std::string line =
      hand ? formatted("hand   %-13.64s sends %.0f poses/s, %.1f contact models/s came, %.1f %% lost", r.name.c_str(),
                       r.rate_hz, r.came_per_s, 100 * r.lost_fraction)
           : formatted("viewer %-13.64s hears %.0f states/s, %.1f came, %.1f %% of their pieces lost, %.0f ms late",
                       r.name.c_str(), r.rate_hz, r.came_per_s, 100 * r.lost_fraction, 1e3 * r.late_s);
  if (r.age_median_s > 0)
    line += std::string(hand ? "; a pose is answered after " : "; states are ") + milliseconds(r.age_median_s) +
            (hand ? ", 99 % within " : " old, 99 % within ") + milliseconds(r.age_p99_s);
  if (r.round_trip_s > 0)
    line += "; round trip " + milliseconds(r.round_trip_s) + ", clock " + milliseconds(r.clock_offset_s) + " behind";
  return line;
}

void LinkClock::hear(double now_s, std::uint64_t client, const ServerStatus& status) {
  const auto own = std::find_if(status.link_reports.begin(), status.link_reports.end(),
                                [&](const LinkReport& report) { return report.client == client; });
  if (own == status.link_reports.end() || own->heard_s == 0 || status.sent_s == 0) return;
  const double there_s = own->heard_s - own->sent_s, back_s = status.sent_s - now_s;
  exchanges_.push_back({std::max(0.0, there_s - back_s), (there_s + back_s) / 2});
  if (exchanges_.size() > kExchanges) exchanges_.pop_front();
}

LinkClock::Exchange LinkClock::best() const {
  if (exchanges_.empty()) return {};
  return *std::min_element(exchanges_.begin(), exchanges_.end(),
                           [](const Exchange& a, const Exchange& b) { return a.round_trip_s < b.round_trip_s; });
}

void LinkClock::stamp(double now_s, LinkReport& report) const {
  report.round_trip_s = best().round_trip_s;
  report.clock_offset_s = best().offset_s;
  report.sent_s = now_s;
}

void Ages::take(LinkReport& report, double offset_s) {
  if (ages_s_.empty()) return;
  report.age_median_s = std::max(0.0, quantile(ages_s_, 0.5) + offset_s);
  report.age_p99_s = std::max(0.0, quantile(ages_s_, 0.99) + offset_s);
  ages_s_.clear();
}

}  // namespace sectio
