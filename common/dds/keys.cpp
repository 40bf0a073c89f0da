#include "common/dds/keys.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <regex>

#include "common/core/error.h"
#include "common/dds/participant.h"
#include "common/messages/session.h"

namespace sectio {
namespace {

template <auto Free>
struct Freeing {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
template <class T, auto Free>
using Owned = std::unique_ptr<T, Freeing<Free>>;
using File = Owned<std::FILE, std::fclose>;
using Certificate = Owned<X509, X509_free>;
using Name = Owned<X509_NAME, X509_NAME_free>;

constexpr const char* kRevoked = "revoked.pem";
constexpr const char* kPermissions = "permissions.p7s";
constexpr const char* kFiles[] = {"cert.pem",       "key.pem",    "ca.pem", "permissions_ca.pem",
                                  "governance.p7s", kPermissions, kRevoked};
constexpr std::size_t kHashedBytes = 6;  // a program's identity: a bit that is set, and 47 of the hash

[[noreturn]] void refuse(const std::string& directory, const std::string& why) {
  throw InputError("--keys " + directory + ": " + why);
}

File open(const std::string& path) {
  return File(std::fopen(path.c_str(), "rb"));
}

Certificate certificate_in(const std::string& path) {
  const File file = open(path);
  return Certificate(file ? PEM_read_X509(file.get(), nullptr, nullptr, nullptr) : nullptr);
}

std::string common_name_of(const X509* certificate) {
  std::array<char, 256> text{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, text.data(), text.size());
  return text.data();
}

std::string last_day_of(const X509* certificate) {
  std::tm time{};
  std::array<char, 16> text{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &time) == 1)
    std::strftime(text.data(), text.size(), "%Y-%m-%d", &time);
  return text.data();
}

// The reason why the certificate isn't one of the authority, or is one no more. Empty: it is one.
std::string flaw_of(X509* certificate, X509* authority, const std::string& revocations) {
  const Owned<X509_STORE, X509_STORE_free> store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  const File file = open(revocations);
  const Owned<X509_CRL, X509_CRL_free> list(file ? PEM_read_X509_CRL(file.get(), nullptr, nullptr, nullptr) : nullptr);
  if (!list) return std::string(kRevoked) + " is damaged";
  X509_STORE_add_crl(store.get(), list.get());
  X509_STORE_set_flags(store.get(), X509_V_FLAG_CRL_CHECK);
  const Owned<X509_STORE_CTX, X509_STORE_CTX_free> context(X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), certificate, nullptr);
  if (X509_verify_cert(context.get()) == 1) return "";
  const int error = X509_STORE_CTX_get_error(context.get());
  const std::string who = common_name_of(certificate);
  if (error == X509_V_ERR_CERT_HAS_EXPIRED) return "the keys of " + who + " expired on " + last_day_of(certificate);
  if (error == X509_V_ERR_CERT_REVOKED) return "the keys of " + who + " were revoked";
  return "cert.pem: " + std::string(X509_verify_cert_error_string(error));
}

// The domains for which signed permissions are, if a domain isn't among them: "79", "3 to 9 or 79". Empty: it is, or
// they say it in a form that is left to DDS.
std::string domains_without(const std::string& permissions, std::uint32_t domain) {
  static const std::regex kEntry(
      R"(<id>\s*(\d{1,4})\s*</id>|<id_range>\s*<min>\s*(\d{1,4})\s*</min>\s*<max>\s*(\d{1,4})\s*</max>)");
  static const std::regex kOther(R"(<deny_rule>|<id_range>\s*<m(in|ax)>[^<]*</m(in|ax)>\s*</id_range>)");
  std::ifstream file(permissions, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  if (std::regex_search(text, kOther)) return "";
  std::string names;
  for (std::sregex_iterator at(text.begin(), text.end(), kEntry), none; at != none; ++at) {
    const bool is_one = (*at)[1].matched;
    const std::string least = (*at)[is_one ? 1 : 2], most = (*at)[is_one ? 1 : 3];
    if (std::stoul(least) <= domain && domain <= std::stoul(most)) return "";
    names += (names.empty() ? "" : " or ") + least + (is_one ? "" : " to " + most);
  }
  return names;
}

// The beginning of the identity of every program with a certificate of this name.
std::array<std::uint8_t, kHashedBytes> hash_of_name(const std::string& common_name) {
  const Name name(X509_NAME_new());
  X509_NAME_add_entry_by_NID(name.get(), NID_commonName, MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>(common_name.data()),
                             static_cast<int>(common_name.size()), -1, 0);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  X509_NAME_digest(name.get(), EVP_sha256(), digest.data(), nullptr);
  std::array<std::uint8_t, kHashedBytes> hash{};
  for (std::size_t i = 0; i < kHashedBytes; ++i)
    hash[i] = static_cast<std::uint8_t>((i == 0 ? 0x80 : digest[i - 1] << 7) | digest[i] >> 1);
  return hash;
}

}  // namespace

std::optional<Keys> Keys::of(const NetworkOptions& options) {
  if (!options.keys.empty() && options.insecure) throw InputError("--insecure: a program with --keys is secured");
  if (options.insecure) return std::nullopt;
  const char* named = std::getenv("SECTIO_KEYS");
  const std::string directory = !options.keys.empty() || named == nullptr ? options.keys : named;
  if (directory.empty()) return std::nullopt;
  Keys keys(directory);
  if (const std::string domains = domains_without(keys.file(kPermissions), options.domain); !domains.empty())
    refuse(directory, "they are for domain " + domains + ", and this program is in domain " +
                          std::to_string(options.domain) + " (--domain)");
  return keys;
}

Keys::Keys(std::string directory) : directory_(std::move(directory)) {
  for (const char* name : kFiles)
    if (!open(file(name)))
      refuse(directory_,
             std::string("no ") + name +
                 " can be read there; deploy/keys (of a package: sectio_keys) makes keys, a directory each");
  const Certificate own = certificate_in(file("cert.pem")), authority = certificate_in(file("ca.pem"));
  if (!own) refuse(directory_, "cert.pem is no certificate");
  if (!authority) refuse(directory_, "ca.pem is no certificate");
  const File key_file = open(file("key.pem"));
  const Owned<EVP_PKEY, EVP_PKEY_free> key(PEM_read_PrivateKey(key_file.get(), nullptr, nullptr, nullptr));
  if (!key || X509_check_private_key(own.get(), key.get()) != 1) refuse(directory_, "key.pem is not that of cert.pem");
  if (const std::string flaw = flaw_of(own.get(), authority.get(), file(kRevoked)); !flaw.empty())
    refuse(directory_, flaw);
  identity_ = common_name_of(own.get());
  authority_ = common_name_of(authority.get());
  if (identity_.empty() || authority_.empty()) refuse(directory_, "a certificate has no name (CN)");
  directory_ = std::filesystem::absolute(directory_).string();
}

std::vector<std::pair<std::string, std::string>> Keys::properties() const {
  const std::string authentication = "dds.sec.auth.builtin.PKI-DH.",
                    access = "dds.sec.access.builtin.Access-Permissions.";
  const auto uri = [&](const char* name) { return "file://" + file(name); };
  std::vector<std::pair<std::string, std::string>> properties{
      {"dds.sec.auth.plugin", "builtin.PKI-DH"},
      {authentication + "identity_ca", uri("ca.pem")},
      {authentication + "identity_certificate", uri("cert.pem")},
      {authentication + "private_key", uri("key.pem")},
      {"dds.sec.access.plugin", "builtin.Access-Permissions"},
      {access + "permissions_ca", uri("permissions_ca.pem")},
      {access + "governance", uri("governance.p7s")},
      {access + "permissions", uri(kPermissions)},
      {"dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC"},
      {authentication + "identity_crl", uri(kRevoked)},
  };
  return properties;
}

std::string trainee_of(std::uint32_t tool_id) {
  return kTrainee + std::to_string(tool_id);
}

std::optional<std::uint32_t> instrument_of_trainee(const ProgramId& program) {
  static const auto hashes = [] {
    std::array<std::array<std::uint8_t, kHashedBytes>, kMaxTools> all;
    for (std::size_t tool = 0; tool < all.size(); ++tool)
      all[tool] = hash_of_name(trainee_of(static_cast<std::uint32_t>(tool)));
    return all;
  }();
  for (std::size_t tool = 0; tool < hashes.size(); ++tool)
    if (std::equal(hashes[tool].begin(), hashes[tool].end(), program.begin())) return static_cast<std::uint32_t>(tool);
  return std::nullopt;
}

}  // namespace sectio
