// A participant announces to every other participant of its domain which session it belongs to and which version of
// the wire it speaks, before any message passes between them. The text travels as the participant's user data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sectio {

struct Announcement {
  std::uint32_t protocol = 0;
  std::string session;  // empty: none
  bool operator==(const Announcement&) const = default;
};

// "sectio protocol=2 session=theatre"
std::string to_user_data(const Announcement& announcement);

// Nothing for the user data of other programs, whatever they hold.
std::optional<Announcement> announcement_from(std::string_view user_data);

}  // namespace sectio
