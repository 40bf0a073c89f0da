// The version of the wire. Programs of different versions don't exchange messages; each says so in one line.
#pragma once

#include <cstdint>

namespace sectio {

// Goes up with every change of a message, a topic or its meaning; a test knows the description of the messages that
// belongs to this number. Former versions:
//
//   1  before programs announced it
//   2  before hands could wish
//   3  before epochs had terms
//   4  before viewers chose a rate and pulled keyframes
//   5  before sessions were led
//   6  before contacts had a response
//   7  before an order could seek another time of a played session
//   8  before changes of topology were merged, programs reported on their links, and bodies had a matter and layers
//   9  before instruments could be frozen, and the task was part of the scene
//  10  before a server told where ends what it plays, and sessions were named for the program that begins them
//  11  before a contact said that jaws hold something
//  12  before a status told the speed at which a paused session goes on
//  13  before orders were for servers that are there alone
constexpr std::uint32_t kProtocolVersion = 14;

}  // namespace sectio
