// The messages and idl/ describe the same wire. Fast CDR, with the types that fastddsgen makes of idl/, reads the bytes
// of every message and writes them again; and the description that fields() gives is the text of idl/.
#include <fastcdr/Cdr.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "common/dds/qos.h"
#include "common/math/hash.h"
#include "common/messages/codec.h"
#include "common/messages/inputs_fields.h"
#include "common/messages/protocol.h"
#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"
#include "common/messages/visit.h"
#include "idl/inputs.h"
#include "idl/session.h"
#include "idl/state.h"
#include "idl/tool.h"
#include "idl/topology.h"
#include "tests/unit/dds/messages.h"

namespace sectio::dds_test {
namespace {

using namespace test;

template <class T>
std::string type_name() {  // "std::string sectio::{anonymous}::type_name() [with T = sectio::BodyInfo; ...]"
  const std::string text = __PRETTY_FUNCTION__;
  const std::size_t begin = text.find("T = ") + 4;
  const std::string name = text.substr(begin, text.find_first_of(";]", begin) - begin);
  return name.substr(name.rfind(':') + 1);
}

// Writes a message as the structs of IDL.
class IdlWriter {
 public:
  explicit IdlWriter(std::map<std::string, std::string>& structs) : structs_(structs) {}

  template <class T>
  void operator()(const std::string& name, const T& value, Limits own = {}, Limits element = {}) {
    body_ += declare(name, value, own, element);
  }

  template <class T>
  static void write(const T& value, std::map<std::string, std::string>& structs) {
    IdlWriter inner(structs);
    fields(inner, value);
    structs[type_name<T>()] = inner.body_;
  }

 private:
  template <class T>
  std::string type(const T& value, Limits own) {
    if constexpr (std::is_same_v<T, bool>) return "boolean";
    if constexpr (std::is_same_v<T, std::uint8_t> || std::is_enum_v<T>) return "octet";
    if constexpr (std::is_same_v<T, std::uint16_t>) return "unsigned short";
    if constexpr (std::is_same_v<T, std::uint32_t>) return "unsigned long";
    if constexpr (std::is_same_v<T, std::int32_t>) return "long";
    if constexpr (std::is_same_v<T, std::uint64_t>) return "unsigned long long";
    if constexpr (std::is_same_v<T, float>) return "float";
    if constexpr (std::is_same_v<T, double>) return "double";
    if constexpr (std::is_same_v<T, std::string>) return "string<" + number(own.most) + ">";
    if constexpr (visit::Struct<T>) {
      write(value, structs_);
      return type_name<T>();
    }
    return "?";
  }
  static std::string number(double x) { return std::to_string(static_cast<long long>(x)); }

  template <class T>
  std::string declare(const std::string& name, const T& value, Limits own, Limits) {
    return type(value, own) + " " + name + "; ";
  }
  std::string declare(const std::string& name, const Vec3&, Limits, Limits) { return "double " + name + "[3]; "; }
  std::string declare(const std::string& name, const Eigen::Quaterniond&, Limits, Limits) {
    return "double " + name + "[4]; ";
  }
  template <class T, std::size_t N>
  std::string declare(const std::string& name, const std::array<T, N>& values, Limits, Limits) {
    return type(values[0], {}) + " " + name + "[" + std::to_string(N) + "]; ";
  }
  // Sequences of a million and more are written without a bound: fastddsgen would make room for all of them.
  template <class T>
  std::string declare(const std::string& name, const std::vector<T>& values, Limits own, Limits element) {
    const std::string bound = own.most < 30000 ? ", " + number(own.most) : "";
    return "sequence<" + type(values.empty() ? T{} : values[0], element) + bound + "> " + name + "; ";
  }
  template <class T>
  std::string declare(const std::string& name, const std::optional<T>&, Limits own, Limits element) {
    return "boolean has_" + name + "; " + declare(name, T{}, own, element);
  }

  std::map<std::string, std::string>& structs_;
  std::string body_;
};

std::map<std::string, std::string> structs_of_messages() {
  std::map<std::string, std::string> structs;
  for_each_message([&](const auto& message) { IdlWriter::write(message, structs); });
  return structs;
}

// The structs of idl/, without comments, each member once and with single blanks.
std::map<std::string, std::string> structs_of_idl() {
  std::map<std::string, std::string> structs;
  for (const char* name : {"tool", "topology", "state", "session", "inputs"}) {
    std::ifstream file(std::string(SECTIO_SOURCE_DIR "/idl/") + name + ".idl");
    std::stringstream all;
    for (std::string line; std::getline(file, line);) all << line.substr(0, line.find("//")) << ' ';
    const std::string text = std::regex_replace(all.str(), std::regex("\\s+"), " ");
    const std::regex one("struct (\\w+) \\{ ([^}]*)\\}");
    for (std::sregex_iterator at(text.begin(), text.end(), one), end; at != end; ++at) structs[(*at)[1]] = (*at)[2];
  }
  return structs;
}

TEST(Idl, is_what_the_messages_are) {
  const auto messages = structs_of_messages(), idl = structs_of_idl();
  for (const auto& [name, members] : messages) {
    ASSERT_TRUE(idl.contains(name)) << name << " { " << members << "}";
    EXPECT_EQ(idl.at(name), members) << name;
  }
  EXPECT_EQ(idl.size(), messages.size());
}

// Programs of one version must mean the same by it.
TEST(Idl, has_not_changed_since_this_version_of_the_protocol) {
  std::string all;
  for (const auto& [name, members] : structs_of_messages()) all += name + "{" + members + "}";
  std::uint64_t hash = 0;
  for (const char c : all) hash = hash_combine(hash, static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  EXPECT_EQ(kProtocolVersion, 14u);
  EXPECT_EQ(hash, 0xb7b1c0466b01c0b4u)
      << "the wire has changed: raise kProtocolVersion, and write both numbers here; hash 0x" << std::hex << hash;
}

// Reads the bytes by Fast CDR and writes them again.
template <class Wire>
std::vector<std::uint8_t> through_fast_cdr(std::vector<std::uint8_t> bytes) {
  using namespace eprosima::fastcdr;
  FastBuffer in(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr reader(in, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  reader.read_encapsulation();
  Wire message;
  message.deserialize(reader);
  EXPECT_EQ(reader.getSerializedDataLength(), bytes.size()) << "bytes are left";
  std::vector<std::uint8_t> result(bytes.size() + 64);
  FastBuffer out(reinterpret_cast<char*>(result.data()), result.size());
  Cdr writer(out, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  writer.serialize_encapsulation();
  message.serialize(writer);
  result.resize(writer.getSerializedDataLength());
  return result;
}

TEST(Idl, fast_cdr_reads_and_writes_the_same_bytes) {
  EXPECT_EQ(through_fast_cdr<wire::ToolPacket>(encode(some_packet())), encode(some_packet()));
  EXPECT_EQ(through_fast_cdr<wire::StepInputs>(encode(some_inputs())), encode(some_inputs()));
  EXPECT_EQ(through_fast_cdr<wire::StepRequest>(encode(some_step_request())), encode(some_step_request()));
  EXPECT_EQ(through_fast_cdr<wire::ToolWish>(encode(some_wish())), encode(some_wish()));
  EXPECT_EQ(through_fast_cdr<wire::ContactMessage>(encode(some_contact())), encode(some_contact()));
  EXPECT_EQ(through_fast_cdr<wire::DeltaMessage>(encode(some_delta())), encode(some_delta()));
  EXPECT_EQ(through_fast_cdr<wire::KeyframeChunk>(encode(some_chunk())), encode(some_chunk()));
  EXPECT_EQ(through_fast_cdr<wire::KeyframeRequest>(encode(some_request())), encode(some_request()));
  EXPECT_EQ(through_fast_cdr<wire::StateHeader>(encode(some_header())), encode(some_header()));
  EXPECT_EQ(through_fast_cdr<wire::StatePiece>(encode(some_piece())), encode(some_piece()));
  EXPECT_EQ(through_fast_cdr<wire::ScalarPiece>(encode(some_scalars())), encode(some_scalars()));
  EXPECT_EQ(through_fast_cdr<wire::SceneInfo>(encode(some_scene())), encode(some_scene()));
  EXPECT_EQ(through_fast_cdr<wire::SessionEvent>(encode(some_event())), encode(some_event()));
  EXPECT_EQ(through_fast_cdr<wire::ServerStatus>(encode(some_status())), encode(some_status()));
  EXPECT_EQ(through_fast_cdr<wire::LinkReport>(encode(some_report())), encode(some_report()));
  EXPECT_EQ(through_fast_cdr<wire::SessionOrder>(encode(some_order())), encode(some_order()));
  EXPECT_EQ(through_fast_cdr<wire::SessionEnd>(encode(some_end())), encode(some_end()));
}

TEST(Idl, fast_cdr_finds_the_values_where_they_belong) {
  using namespace eprosima::fastcdr;
  std::vector<std::uint8_t> bytes = encode(some_scene());
  FastBuffer in(reinterpret_cast<char*>(bytes.data()), bytes.size());
  Cdr reader(in, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  reader.read_encapsulation();
  wire::SceneInfo scene;
  scene.deserialize(reader);
  EXPECT_EQ(scene.session().to_string(), "theatre");
  EXPECT_EQ(scene.camera().field_of_view_deg(), 50);
  EXPECT_TRUE(scene.has_floor_z_m());
  EXPECT_EQ(scene.floor_z_m(), -0.03);
  EXPECT_EQ(scene.tools().at(0).d_tool_m()[2], 1);
}

}  // namespace
}  // namespace sectio::dds_test
