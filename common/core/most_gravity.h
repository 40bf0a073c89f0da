// The largest gravity that a scene may begin with, or an order may turn a session to: ten times the Earth's.
#pragma once

namespace sectio {

constexpr double kMostGravity_m_per_s2 = 100;  // along each axis

}  // namespace sectio
