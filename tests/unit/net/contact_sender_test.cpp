#include "sim_server/net/contact_sender.h"

#include <gtest/gtest.h>

#include <future>

namespace sectio::net_test {
namespace {

ContactModel model_of(std::uint32_t tool_id, std::uint64_t sequence) {
  ContactModel model;
  model.tool_id = tool_id;
  model.sequence = sequence;
  return model;
}

TEST(ContactSender, sends_of_each_instrument_the_newest_contact_while_the_wire_is_slow) {
  std::promise<void> first, go_on;
  std::vector<ContactModel> sent;
  {
    ContactSender sender([&](const ContactModel& model) {
      if (sent.empty()) {
        first.set_value();
        go_on.get_future().wait();
      }
      sent.push_back(model);
    });
    sender.put(std::vector{model_of(0, 1)});
    first.get_future().wait();
    for (const std::uint64_t sequence : {2u, 3u})
      for (const std::uint32_t tool : {0u, 1u}) sender.put(std::vector{model_of(tool, sequence)});
    go_on.set_value();
  }
  ASSERT_EQ(sent.size(), 3u);
  EXPECT_EQ(sent[0].sequence, 1u);
  for (const std::size_t i : {1u, 2u}) EXPECT_EQ(sent[i].sequence, 3u);
}

}  // namespace
}  // namespace sectio::net_test
