// Messages as bytes and back, without any library: what DDS carries, and what any other carrier can. The bytes are
// plain CDR as OMG specifies it for DDS (XCDR version 1, final types, little-endian), so that a program which knows
// idl/ reads them with any vendor's DDS.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace sectio {

// For the messages that the list at the end of codec.cpp names.
template <class Message>
std::vector<std::uint8_t> encode(const Message& message);

// Nothing for bytes that are no valid Message, whatever they are: too short or too long, counts that lie, values beyond
// their limits. A message that is returned can be used without another check. Allocates at most a small multiple of
// the bytes.
template <class Message>
std::optional<Message> decode(std::span<const std::uint8_t> bytes);

}  // namespace sectio
