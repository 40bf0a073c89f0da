#include "common/messages/epoch_owners.h"

#include <gtest/gtest.h>

#include <set>

namespace sectio::dds_test {
namespace {

class Owners : public testing::Test {
 protected:
  static ProgramId program(std::uint8_t number) { return {number}; }

  std::set<std::uint8_t> gone;
  EpochOwners owners{[this](const ProgramId& id) { return !gone.contains(id[0]); }};
};

TEST_F(Owners, an_epoch_is_that_of_the_first_program_that_is_there) {
  EXPECT_TRUE(owners.announce(10, program(1)));
  EXPECT_FALSE(owners.announce(10, program(2)));
  EXPECT_TRUE(owners.owns(10, program(1)));
  gone = {1};
  EXPECT_TRUE(owners.owns(10, program(2)));
  EXPECT_FALSE(owners.owns(11, program(2)));
}

TEST_F(Owners, a_program_that_begins_anew_again_and_again_owns_its_newest_epochs) {
  for (std::uint64_t epoch = 1; epoch <= 1000; ++epoch) {
    EXPECT_TRUE(owners.announce(epoch, program(1)));
    EXPECT_EQ(owners.owns(epoch - 1, program(1)), epoch > 1);  // viewers may go back to it
  }
  EXPECT_FALSE(owners.knows(1));
}

TEST_F(Owners, a_program_that_announces_many_takes_none_of_another) {
  EXPECT_TRUE(owners.announce(10, program(1)));
  for (std::uint64_t epoch = 1; epoch <= 1000; ++epoch) owners.announce(epoch, program(2));
  EXPECT_TRUE(owners.owns(10, program(1)));
  EXPECT_FALSE(owners.owns(10, program(2)));
  EXPECT_TRUE(owners.announce(1001, program(3)));
}

}  // namespace
}  // namespace sectio::dds_test
