#include "common/messages/epoch_owners.h"

#include <gtest/gtest.h>

#include <set>

namespace sectio::dds_test {
namespace {

class Owners : public testing::Test {
 protected:
  static ProgramId program(std::uint8_t number) { return {number}; }
  // So that the sessions of a test have been heard for long.
  void wait() { now_s += EpochOwners::kWaits_s; }

  std::set<std::uint8_t> gone;
  double now_s = 0;
  EpochOwners owners{[this](const ProgramId& id) { return !gone.contains(id[0]); }, [this] { return now_s; }};
};

TEST_F(Owners, an_epoch_is_that_of_the_first_program_that_is_there) {
  owners.announce(10, program(1));
  wait();
  EXPECT_TRUE(owners.owns(10, program(1)));
  EXPECT_FALSE(owners.announce(10, program(2)));
  EXPECT_TRUE(owners.owns(10, program(1)));
  gone = {1};
  EXPECT_TRUE(owners.owns(10, program(2)));
  EXPECT_FALSE(owners.owns(11, program(2)));
}

// It hears both at once, and the stranger may be the first.
TEST_F(Owners, whoever_comes_late_believes_the_program_that_began_the_session) {
  const std::uint64_t epoch = new_epoch(program(1));
  EXPECT_FALSE(owners.announce(epoch, program(2))) << "it waits";
  EXPECT_TRUE(owners.announce(epoch, program(1)));
  EXPECT_TRUE(owners.belongs_to_another(epoch, program(2)));
  wait();
  EXPECT_FALSE(owners.owns(epoch, program(2)));
  EXPECT_TRUE(owners.owns(epoch, program(1)));
  EXPECT_TRUE(owners.announce(epoch + 1, program(1))) << "begun anew";
  EXPECT_TRUE(owners.announce(epoch + 2, program(3))) << "taken over, and the session is known by now";
}

TEST_F(Owners, a_session_that_another_program_has_taken_over_is_heard_after_a_moment) {
  const std::uint64_t epoch = next_term(new_epoch(program(1)));
  EXPECT_FALSE(owners.announce(epoch, program(2)));
  EXPECT_FALSE(owners.belongs_to_another(epoch, program(2))) << "nobody is called an impostor meanwhile";
  wait();
  EXPECT_TRUE(owners.owns(epoch, program(2)));
}

TEST_F(Owners, the_program_that_began_a_session_finds_room_in_a_long_line) {
  const std::uint64_t epoch = new_epoch(program(1));
  for (std::uint8_t stranger = 2; stranger < 100; ++stranger) owners.announce(epoch, program(stranger));
  EXPECT_TRUE(owners.announce(epoch, program(1)));
}

TEST_F(Owners, a_program_that_begins_anew_again_and_again_owns_its_newest_epochs) {
  const std::uint64_t begun = new_epoch(program(1));
  for (std::uint64_t term = 1; term <= 1000; ++term) {
    EXPECT_TRUE(owners.announce(begun + term, program(1)));
    EXPECT_EQ(owners.owns(begun + term - 1, program(1)), term > 1);  // viewers may go back to it
  }
  EXPECT_FALSE(owners.owns(begun + 1, program(1)));
}

TEST_F(Owners, a_program_that_announces_many_takes_none_of_another) {
  owners.announce(first_epoch(2000), program(1));
  for (std::uint64_t name = 1; name <= 1000; ++name) owners.announce(first_epoch(name), program(2));
  owners.announce(first_epoch(2001), program(3));
  wait();
  EXPECT_TRUE(owners.owns(first_epoch(2000), program(1)));
  EXPECT_FALSE(owners.owns(first_epoch(2000), program(2)));
  EXPECT_TRUE(owners.owns(first_epoch(2001), program(3)));
}

TEST_F(Owners, a_server_that_lives_takes_back_what_another_program_has_claimed) {
  const std::uint64_t begun = new_epoch(program(1));
  owners.announce(begun, program(1));
  wait();
  EXPECT_TRUE(owners.announce(begun + 1, program(2))) << "the first may have died";
  EXPECT_FALSE(owners.may_end(begun + 1, program(2))) << "not yet";
  EXPECT_TRUE(owners.announce(begun + 3, program(1)));
  EXPECT_FALSE(owners.owns(begun + 1, program(2)));
  EXPECT_FALSE(owners.announce(begun + 5, program(2))) << "never again";
  owners.hear(begun + 3, program(1));
  EXPECT_FALSE(owners.announce(begun + 6, program(3))) << "while the server speaks";
  now_s += 2 * EpochOwners::kSpeaks_s;
  EXPECT_TRUE(owners.owns(begun + 6, program(3))) << "it has fallen silent";
}

TEST_F(Owners, a_standby_that_follows_a_dead_server_may_end_the_session_and_begin_it_anew) {
  const std::uint64_t begun = new_epoch(program(1));
  owners.announce(begun, program(1));
  wait();
  EXPECT_TRUE(owners.announce(begun + 1, program(2)));
  EXPECT_TRUE(owners.announce(begun + 2, program(2)));
  wait();
  EXPECT_TRUE(owners.may_end(begun + 2, program(2)));
  EXPECT_TRUE(owners.announce(begun + 3, program(3))) << "it has been followed in its turn";
  EXPECT_TRUE(owners.announce(begun + 4, program(1))) << "the first one has come back, and holds it";
}

TEST_F(Owners, a_term_that_nobody_can_outdo_is_not_believed) {
  const std::uint64_t begun = new_epoch(program(1));
  owners.announce(begun, program(1));
  wait();
  EXPECT_FALSE(owners.announce(begun + (1u << kTermBits) - 1, program(2)));
  EXPECT_TRUE(owners.owns(begun, program(1)));
}

}  // namespace
}  // namespace sectio::dds_test
