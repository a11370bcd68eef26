#include <support/policies.hpp>

#include <gart/io/crc32c.hpp>

#include <random>
#include <string>
#include <vector>

namespace {

// Long division, a bit at a time.
gart::u32 by_definition(std::vector<gart::u8> const& bytes) {
  gart::u32 crc = 0xffffffffu;
  for (gart::u8 const byte : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      bool const out = ((crc ^ (byte >> bit)) & 1) != 0;
      crc = (crc >> 1) ^ (out ? 0x82f63b78u : 0);
    }
  }
  return ~crc;
}

}  // namespace

TEST_CASE("CRC-32C gives the values of RFC 3720") {
  auto const of = [](std::vector<gart::u8> const& bytes) { return gart::crc32c(bytes.data(), bytes.size()); };
  std::string const digits = "123456789";
  CHECK(gart::crc32c(digits.data(), digits.size()) == 0xe3069283u);
  CHECK(of(std::vector<gart::u8>(32, 0)) == 0x8a9136aau);
  CHECK(of(std::vector<gart::u8>(32, 0xff)) == 0x62a8ab43u);
  std::vector<gart::u8> rising(32);
  for (std::size_t i = 0; i < 32; ++i) rising[i] = static_cast<gart::u8>(i);
  CHECK(of(rising) == 0x46dd794eu);
  CHECK(of({}) == 0);
}

TEST_CASE("CRC-32C in one part or two equals long division") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (std::size_t size = 0; size < 70; ++size) {
    CAPTURE(size);
    std::vector<gart::u8> bytes(size);
    for (auto& b : bytes) b = static_cast<gart::u8>(random());
    auto const expected = by_definition(bytes);
    CHECK(gart::crc32c(bytes.data(), size) == expected);
    std::size_t const part = random() % (size + 1);
    CHECK(gart::crc32c(bytes.data() + part, size - part, gart::crc32c(bytes.data(), part)) == expected);
    auto const first = gart::crc32c(bytes.data(), part), second = gart::crc32c(bytes.data() + part, size - part);
    CHECK((gart::crc32c_before(first, size - part) ^ second) == expected);
  }
}

TEST_CASE("a checksum with zeros behind its bytes goes far") {
  std::vector<gart::u8> bytes(3000001, 0);
  bytes[0] = 77;
  auto const zeros = gart::crc32c(bytes.data() + 1, bytes.size() - 1);
  CHECK((gart::crc32c_before(gart::crc32c(bytes.data(), 1), bytes.size() - 1) ^ zeros) ==
        gart::crc32c(bytes.data(), bytes.size()));
  CHECK(gart::crc32c_before(0x12345678u, 0) == 0x12345678u);
}
