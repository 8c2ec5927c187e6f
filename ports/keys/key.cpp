#include "ports/keys/key.hpp"

#include <sodium.h>

#include "ports/keys/library.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::keys {

RobotKey new_robot_key(const std::string& name) {
  require_library();
  if (!wire::is_session_name(name)) {
    throw KeyError(
        "\"" + name +
        "\" cannot name a robot: 1 to 64 letters, digits, '.', '_' or '-', no dot first");
  }
  RobotKey key;
  key.name = name;
  key.robot = randombytes_random();
  randombytes_buf(key.link.data(), LinkSecret::size());
  randombytes_buf(key.seed.data(), SigningSeed::size());
  return key;
}

BaseKey base_key_of(const RobotKey& key) {
  require_library();
  BaseKey base;
  base.name = key.name;
  base.robot = key.robot;
  base.link = key.link;
  Secret<crypto_sign_SECRETKEYBYTES> signing;
  crypto_sign_seed_keypair(base.verifying.data(), signing.data(), key.seed.data());
  return base;
}

std::string fingerprint(const BaseKey& key) {
  require_library();
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;
  crypto_generichash(hash.data(), hash.size(), key.verifying.data(), key.verifying.size(), nullptr,
                     0);
  constexpr std::size_t kShown = 4;
  std::array<char, 2 * kShown + 1> text;
  sodium_bin2hex(text.data(), text.size(), hash.data(), kShown);
  return text.data();
}

}  // namespace unimapper::keys
