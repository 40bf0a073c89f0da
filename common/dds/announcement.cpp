#include "common/dds/announcement.h"

#include <charconv>

#include "common/core/words.h"

namespace sectio {
namespace {

constexpr std::string_view kProtocol = "sectio protocol=";
constexpr std::string_view kSession = " session=";
constexpr std::size_t kMostBytes = 256;

}  // namespace

std::string to_user_data(const Announcement& announcement) {
  return std::string(kProtocol) + std::to_string(announcement.protocol) + std::string(kSession) + announcement.session;
}

std::optional<Announcement> announcement_from(std::string_view user_data) {
  if (user_data.size() > kMostBytes || !user_data.starts_with(kProtocol)) return std::nullopt;
  user_data.remove_prefix(kProtocol.size());
  Announcement announcement;
  const auto [rest, error] =
      std::from_chars(user_data.data(), user_data.data() + user_data.size(), announcement.protocol);
  if (error != std::errc{}) return std::nullopt;
  user_data.remove_prefix(static_cast<std::size_t>(rest - user_data.data()));
  if (!user_data.starts_with(kSession)) return std::nullopt;
  user_data.remove_prefix(kSession.size());
  if (!is_printable(user_data)) return std::nullopt;
  announcement.session = user_data;
  return announcement;
}

}  // namespace sectio
