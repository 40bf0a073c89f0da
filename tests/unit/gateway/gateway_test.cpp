// The gateway against pages that mean well, and against others.
#include "render_client/gateway/gateway.h"

#include <gtest/gtest.h>

#include "common/messages/codec.h"
#include "tests/support/random.h"

namespace sectio::gateway_test {
namespace {

std::vector<std::uint8_t> frame_of(LiveKind kind, const std::vector<std::uint8_t>& message) {
  std::vector<std::uint8_t> frame;
  append_live(kind, message, frame);
  return frame;
}

struct GatewayTest : testing::Test {
  Gateway gateway{{"secret", ""}, {.max_clients = 4}, 7};
  double now_s = 100;

  void SetUp() override {
    SceneInfo scene;
    scene.epoch = 1;
    scene.session = "theatre";
    scene.tools = {{"scalpel", "scalpel"}};
    gateway.feed(scene);
  }
  std::uint32_t enter(const std::string& name, const std::string& token = "secret") {
    const std::uint32_t client = gateway.connect().value();
    say(client, LiveKind::hello, Hello{name, token});
    return client;
  }
  template <class Message>
  bool say(std::uint32_t client, LiveKind kind, const Message& message) {
    const bool goes_on = gateway.receive(client, frame_of(kind, encode(message)), now_s);
    gateway.tick(now_s);
    return goes_on;
  }
  bool wish(std::uint32_t client, double x_m, std::uint32_t tool = 0) {
    return say(client, LiveKind::wish, ToolWish{1, tool, 1, Pose{Vec3(x_m, 0, 0)}, true});
  }
  std::vector<std::string> notices(std::uint32_t client) {
    std::vector<std::string> texts;
    for (std::vector<std::uint8_t> frame; gateway.next_frame(client, frame);) {
      LiveFrameReader reader(frame);
      while (const auto message = reader.next())
        if (message->kind == LiveKind::notice) texts.push_back(decode<Notice>(message->bytes)->text);
    }
    return texts;
  }
};

TEST_F(GatewayTest, passes_on_once_what_is_said_again_when_it_joins_anew) {
  const std::uint32_t ada = enter("Ada");
  for (int again = 0; again < 2; ++again)
    for (const char* line : {"cut along the line", "at most 2 mm beside it"})
      gateway.feed(SessionEvent{1, 0, kScoreTold, 0, 0, line});
  const auto events = [&](std::uint32_t client) {
    int count = 0;
    for (std::vector<std::uint8_t> frame; gateway.next_frame(client, frame);) {
      LiveFrameReader reader(frame);
      while (const auto message = reader.next()) count += message->kind == LiveKind::event;
    }
    return count;
  };
  EXPECT_EQ(events(ada), 2);
  EXPECT_EQ(events(enter("Ben")), 2) << "who comes later";
}

TEST_F(GatewayTest, tells_who_comes_later_more_than_that_the_server_was_late) {
  gateway.feed(SessionEvent{1, 1, kCutRefused, 0, 0, "the body is frozen"});
  for (std::uint64_t step = 2; step < 100; ++step) {
    gateway.feed(SessionEvent{1, step, kStepOverrun, 0, 0, "slowed: " + std::to_string(step) + " ms behind"});
    gateway.feed(SessionEvent{1, step, 0, 0, 0, ""});
  }
  std::vector<std::string> texts;
  const std::uint32_t late = enter("Late");
  for (std::vector<std::uint8_t> frame; gateway.next_frame(late, frame);) {
    LiveFrameReader reader(frame);
    while (const auto message = reader.next())
      if (message->kind == LiveKind::event) texts.push_back(decode<SessionEvent>(message->bytes)->text);
  }
  EXPECT_EQ(texts, (std::vector<std::string>{"the body is frozen", "slowed: 99 ms behind"}));
}

TEST_F(GatewayTest, passes_on_the_wishes_of_the_holder_alone) {
  const std::uint32_t ada = enter("Ada"), ben = enter("Ben");
  wish(ada, 0);
  EXPECT_EQ(gateway.counts().refused_not_holder, 1u);
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  wish(ada, 0.01);
  wish(ben, 0.5);
  wish(ada, 0.01, 5);
  const std::vector<ToolWish> wishes = gateway.take_wishes();
  ASSERT_EQ(wishes.size(), 1u);
  EXPECT_EQ(wishes[0].source, 7u) << "the gateway's own, whatever the page says";
  EXPECT_EQ(wishes[0].pose_world.position_m.x(), 0.01);
  EXPECT_EQ(gateway.counts().refused_not_holder, 3u);
}

TEST_F(GatewayTest, lets_go_of_what_its_holder_leaves_behind) {
  const std::uint32_t ada = enter("Ada");
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  wish(ada, 0.01);
  gateway.take_wishes();
  gateway.disconnect(ada);
  gateway.tick(now_s);
  const std::vector<ToolWish> wishes = gateway.take_wishes();
  ASSERT_EQ(wishes.size(), 1u);
  EXPECT_FALSE(wishes[0].held);
}

TEST_F(GatewayTest, gives_who_comes_later_what_moves_no_more) {
  for (std::uint32_t piece = 0; piece < 3; ++piece)
    for (std::uint64_t step = 1; step < 5; ++step)
      gateway.feed(StatePiece{1, step, 0, 0, piece, kQuantum_m, {0, 0, 0}, {1, 2, 3}});
  const std::uint32_t late = enter("Late");
  std::vector<std::uint64_t> steps;
  for (std::vector<std::uint8_t> frame; gateway.next_frame(late, frame);) {
    LiveFrameReader reader(frame);
    while (const auto message = reader.next())
      if (message->kind == LiveKind::state_piece) steps.push_back(decode<StatePiece>(message->bytes)->step);
  }
  EXPECT_EQ(steps, (std::vector<std::uint64_t>{4, 4, 4}));
}

TEST_F(GatewayTest, tells_who_is_refused_why) {
  const std::uint32_t ada = enter("Ada"), eve = enter("Eve", "guess");
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  say(eve, LiveKind::claim, ToolClaim{0, ClaimAction::take});
  EXPECT_EQ(notices(eve), (std::vector<std::string>{"the token in the address is not this session's: you watch",
                                                    "observers can't hold the scalpel"}));
  EXPECT_EQ(gateway.counts().refused_tokens, 1u);
  EXPECT_EQ(gateway.counts().refused_claims, 1u);
}

TEST_F(GatewayTest, refuses_and_counts_one_client_too_many) {
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(gateway.connect());
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(gateway.connect());
  EXPECT_EQ(gateway.counts().clients_refused, 1000u);
  EXPECT_EQ(gateway.clients(), 4u);
}

TEST_F(GatewayTest, counts_wishes_that_are_faster_than_hands) {
  const std::uint32_t ada = enter("Ada");
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  for (int i = 0; i < 10; ++i, now_s += 0.02) wish(ada, 0.02 * i);  // 1 m/s
  EXPECT_EQ(gateway.counts().wishes_too_fast, 0u);
  for (int i = 0; i < 10; ++i, now_s += 0.02) wish(ada, 2.0 * i);  // 100 m/s
  EXPECT_GE(gateway.counts().wishes_too_fast, 9u);
}

TEST_F(GatewayTest, passes_orders_of_who_leads_on_and_no_others) {
  const std::uint32_t ada = enter("Ada"), eve = *gateway.connect();
  EXPECT_TRUE(say(ada, LiveKind::order, SessionOrder{0, OrderKind::pause}));
  EXPECT_TRUE(say(ada, LiveKind::order, SessionOrder{0, OrderKind::go_on}));
  EXPECT_TRUE(say(eve, LiveKind::order, SessionOrder{0, OrderKind::begin_anew}));
  const std::vector<SessionOrder> orders = gateway.take_orders();
  ASSERT_EQ(orders.size(), 2u);
  EXPECT_EQ(orders[0].kind, OrderKind::pause);
  EXPECT_NE(orders[0].source, orders[1].source) << "servers take each once";
  EXPECT_EQ(gateway.counts().refused_orders, 1u);
}

TEST_F(GatewayTest, survives_garbage_and_ends_the_connection_of_who_goes_on_with_it) {
  const std::uint32_t ada = enter("Ada"), eve = enter("Eve");
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  test::Random random(1);
  bool open = true;
  int frames = 0;
  for (; open && frames < 1000; ++frames) {
    std::vector<std::uint8_t> garbage(random() % 200 + 1);
    for (std::uint8_t& byte : garbage) byte = static_cast<std::uint8_t>(random());
    open = gateway.receive(eve, garbage, now_s);
  }
  EXPECT_FALSE(open);
  EXPECT_EQ(frames, static_cast<int>(Conduct::kMaxGarbage));
  EXPECT_EQ(gateway.counts().refused_garbage, Conduct::kMaxGarbage);
  EXPECT_FALSE(gateway.receive(ada, std::vector<std::uint8_t>(Gateway::kMaxMessageBytes + 1), now_s)) << "too long";
  const std::vector<Gateway::Guilty> guilty = gateway.take_guilty();
  ASSERT_EQ(guilty.size(), 1u);
  EXPECT_EQ(guilty[0].client, eve);
  EXPECT_STREQ(guilty[0].fault, "has sent 16 messages that are none");
  gateway.disconnect(eve);
  EXPECT_TRUE(wish(ada, 0.01));
  EXPECT_EQ(gateway.take_wishes().size(), 1u) << "nobody else was disturbed";
}

TEST_F(GatewayTest, ends_the_connection_of_who_goes_on_with_the_instrument_of_another_and_of_no_hand) {
  const std::uint32_t ada = enter("Ada"), eve = enter("Eve");
  say(ada, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  for (int i = 0; i < 100; ++i, now_s += 0.02) EXPECT_TRUE(wish(eve, 1)) << "she has lost it, and doesn't know";
  now_s += 60;
  int wishes = 1;
  for (; wishes < 1000 && wish(eve, 1); ++wishes) now_s += 0.005;
  EXPECT_LT(wishes, 250);
  wish(ada, 0);
  int jumps = 1;
  for (; jumps < 1000 && wish(ada, jumps % 2); ++jumps) now_s += 0.01;
  EXPECT_EQ(jumps, static_cast<int>(Conduct::kMaxTooFast));
  const std::vector<Gateway::Guilty> guilty = gateway.take_guilty();
  ASSERT_EQ(guilty.size(), 2u);
  EXPECT_EQ(gateway.title(guilty[0].client), "browser 2 (Eve)");
  EXPECT_EQ(gateway.title(guilty[1].client), "browser 1 (Ada)");
  EXPECT_EQ(gateway.counts().clients_cut, 2u);
}

TEST_F(GatewayTest, ends_the_connection_of_who_says_nothing_unless_it_was_deaf_itself) {
  const std::uint32_t eve = gateway.connect().value();
  enter("Ada");
  const auto pass = [&](double time_s) {
    for (const double end_s = now_s + time_s; now_s < end_s; now_s += 0.5) gateway.tick(now_s);
  };
  pass(Conduct::kSilence_s - 2);
  now_s += 100;
  pass(Conduct::kSilence_s - 2);
  EXPECT_TRUE(gateway.take_guilty().empty());
  pass(4);
  const std::vector<Gateway::Guilty> guilty = gateway.take_guilty();
  ASSERT_EQ(guilty.size(), 1u);
  EXPECT_EQ(guilty[0].client, eve);
}

// Damaged messages of every kind that a page may send.
TEST_F(GatewayTest, believes_no_message_that_was_changed_beyond_its_limits) {
  const std::uint32_t ada = enter("Ada");
  ToolWish far{1, 0, 1, Pose{Vec3(1e9, 0, 0)}, true};
  wish(ada, 0);
  EXPECT_EQ(gateway.counts().refused_garbage, 0u);
  say(ada, LiveKind::wish, far);
  ToolWish bent{1, 0, 1, Pose{Vec3::Zero(), Eigen::Quaterniond(2, 0, 0, 0)}, true};
  say(ada, LiveKind::wish, bent);
  ToolWish open{1, 0, 1, JointPose{Pose{}, 100}, true};
  say(ada, LiveKind::wish, open);
  say(ada, LiveKind::hello, Hello{"a\nb", ""});
  EXPECT_EQ(gateway.counts().refused_garbage, 4u);
  EXPECT_TRUE(gateway.take_wishes().empty());
}

TEST_F(GatewayTest, people_without_a_name_are_numbered_and_can_take_an_instrument) {
  const std::uint32_t somebody = enter("");
  EXPECT_EQ(gateway.counts().refused_garbage, 0u);
  say(somebody, LiveKind::claim, ToolClaim{0, ClaimAction::claim});
  EXPECT_TRUE(wish(somebody, 0.1));
  EXPECT_EQ(gateway.take_wishes().size(), 1u);
}

TEST_F(GatewayTest, has_its_numbers_in_the_form_of_prometheus) {
  enter("Ada");
  EXPECT_NE(gateway.metrics().find("# TYPE sectio_gateway_clients gauge\nsectio_gateway_clients 1\n"),
            std::string::npos);
}

}  // namespace
}  // namespace sectio::gateway_test
