// External-memory vector, and the temporary file behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace unimapper::merge {

/// What a merge needs again later and does not keep in memory. The file has no name and is gone
/// with the process, however that ends. All throw std::runtime_error.
class ScratchFile {
 public:
  /// In `folder`, which must exist.
  explicit ScratchFile(const std::filesystem::path& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  /// Where the bytes lie from then on. Throws where the disk is full.
  std::uint64_t append(const void* bytes, std::size_t size);
  /// Bytes that were appended. Thread safe.
  void read(std::uint64_t offset, void* bytes, std::size_t size) const;

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// Elements that are appended and read from the first to the last. With a file they are in it but
/// for the last block; without one in memory. Copies share what is in the file. Iterators are input
/// iterators: each holds one block. Reading and appending throw std::runtime_error where the file
/// cannot be read or written.
template <typename T>
class ExternalVector {
  // Eigen's small vectors are not trivially copyable by name, but they are in memory.
  static_assert(std::is_trivially_destructible_v<T>, "elements are written as bytes");
  /// Elements of a block.
  static constexpr std::size_t kBlock = (std::size_t{1} << 16U) / sizeof(T);

 public:
  using value_type = T;  ///< an element

  ExternalVector() = default;
  /// `file`: null keeps everything in memory.
  explicit ExternalVector(std::shared_ptr<ScratchFile> file) : file_(std::move(file)) {}
  ExternalVector(std::initializer_list<T> values) : last_(values) {}

  /// Appends an element; iterators are void after it. O(1), and a block is written now and then.
  void push_back(const T& value) {
    last_.push_back(value);
    if (file_ == nullptr || last_.size() < kBlock) return;
    blocks_.push_back(file_->append(last_.data(), last_.size() * sizeof(T)));
    last_.clear();
  }

  /// Elements. O(1).
  [[nodiscard]] std::size_t size() const { return blocks_.size() * kBlock + last_.size(); }
  /// No element. O(1).
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// Where its elements are; null: in memory.
  [[nodiscard]] const std::shared_ptr<ScratchFile>& file() const { return file_; }

  /// Input iterator that holds the block in which it stands.
  class const_iterator {
   public:
    using iterator_category = std::input_iterator_tag;  ///< read once, forward
    using value_type = T;                               ///< an element
    using difference_type = std::ptrdiff_t;             ///< between positions
    using pointer = const T*;                           ///< into the block
    using reference = const T&;                         ///< valid until the iterator moves

    const_iterator() = default;
    /// At an element, which is read.
    const_iterator(const ExternalVector& of, std::size_t at) : of_(&of), at_(at) { read(); }

    reference operator*() const { return elements_[in_block_]; }
    pointer operator->() const { return elements_ + in_block_; }
    const_iterator& operator++() {
      ++at_;
      ++in_block_;
      if (at_ % kBlock == 0 && at_ <= of_->blocks_.size() * kBlock) read();
      return *this;
    }
    const_iterator operator++(int) {
      const_iterator before = *this;
      ++*this;
      return before;
    }
    friend bool operator==(const const_iterator& a, const const_iterator& b) {
      return a.at_ == b.at_;
    }

   private:
    void read() {
      const std::size_t block = at_ / kBlock;
      if (block >= of_->blocks_.size()) {
        held_.reset();
        in_block_ = at_ - of_->blocks_.size() * kBlock;
        elements_ = of_->last_.data();
        return;
      }
      // A copy of the iterator keeps the block that it stands in.
      auto bytes = std::make_shared<std::vector<T>>(kBlock);
      of_->file_->read(of_->blocks_[block], bytes->data(), kBlock * sizeof(T));
      held_ = std::move(bytes);
      elements_ = held_->data();
      in_block_ = at_ % kBlock;
    }

    const ExternalVector* of_ = nullptr;
    std::size_t at_ = 0;
    std::size_t in_block_ = 0;
    const T* elements_ = nullptr;
    std::shared_ptr<const std::vector<T>> held_;
  };

  /// The first element.
  [[nodiscard]] const_iterator begin() const { return {*this, 0}; }
  /// Beyond the last element.
  [[nodiscard]] const_iterator end() const { return {*this, size()}; }

 private:
  std::shared_ptr<ScratchFile> file_;
  std::vector<std::uint64_t> blocks_;  ///< where each begins
  std::vector<T> last_;
};

}  // namespace unimapper::merge
