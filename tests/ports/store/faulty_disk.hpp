// SQLite's file layer with failures on request.
#pragma once

#include <sqlite3.h>

#include "ports/store/database.hpp"
#include "tests/test.hpp"

namespace unimapper::store::store_test {

/// Ours and the system's, which differ between databases and write-ahead logs.
struct FileMethods {
  sqlite3_io_methods ours{};  // first: a file points to it
  const sqlite3_io_methods* real = nullptr;
};

/// What fails from now on, in this process.
struct FaultyDisk {
  static inline std::atomic<int> write_error{SQLITE_OK};
  static inline std::atomic<int> sync_error{SQLITE_OK};
  /// Writes that succeed before `write_error` counts.
  static inline std::atomic<int> writes_left{0};
  /// Calls that failed.
  static inline std::atomic<int> failures{0};

  /// Every database that is opened later goes through here.
  FaultyDisk() {
    static sqlite3_vfs layer = *sqlite3_vfs_find(nullptr);
    static bool is_installed = false;
    if (!is_installed) {
      real_open = layer.xOpen;
      layer.zName = "faulty";
      layer.xOpen = &open;
      if (sqlite3_vfs_register(&layer, 1) != SQLITE_OK) throw std::runtime_error("no file layer");
      is_installed = true;
    }
    heal();
  }
  ~FaultyDisk() { heal(); }
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;

  static void heal() {
    write_error = SQLITE_OK;
    sync_error = SQLITE_OK;
    writes_left = 0;
    failures = 0;
  }

 private:
  static inline int (*real_open)(sqlite3_vfs*, const char*, sqlite3_file*, int, int*) = nullptr;
  static inline FileMethods of_database;
  static inline FileMethods of_log;

  /// The file stays the system's own; two of its methods are replaced.
  static int open(sqlite3_vfs* layer, const char* name, sqlite3_file* file, int flags, int* out) {
    const int outcome = real_open(layer, name, file, flags, out);
    const bool is_log = (flags & SQLITE_OPEN_WAL) != 0;
    if (outcome != SQLITE_OK || (!is_log && (flags & SQLITE_OPEN_MAIN_DB) == 0)) return outcome;
    FileMethods& methods = is_log ? of_log : of_database;
    if (methods.real == nullptr) {
      methods.real = file->pMethods;
      methods.ours = *methods.real;
      methods.ours.xWrite = &write;
      methods.ours.xSync = &sync;
    }
    if (file->pMethods != methods.real) throw std::runtime_error("another file layer");
    file->pMethods = &methods.ours;
    return outcome;
  }
  static const sqlite3_io_methods& real(const sqlite3_file* file) {
    return *reinterpret_cast<const FileMethods*>(file->pMethods)->real;
  }
  static int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 at) {
    if (write_error == SQLITE_OK || writes_left-- > 0)
      return real(file).xWrite(file, bytes, count, at);
    ++failures;
    return write_error;
  }
  static int sync(sqlite3_file* file, int flags) {
    if (sync_error == SQLITE_OK) return real(file).xSync(file, flags);
    ++failures;
    return sync_error;
  }
};

/// A change on a disk that is full after so many writes, and what became of it.
struct Attempt {
  bool failed = false;   ///< it threw
  bool was_hit = false;  ///< a write failed

  template <typename Change>
  Attempt(int writes, const Change& change) {
    FaultyDisk::writes_left = writes;
    FaultyDisk::write_error = SQLITE_FULL;
    try {
      change();
    } catch (const StoreError&) {
      failed = true;
    }
    was_hit = FaultyDisk::failures > 0;
    FaultyDisk::heal();
  }
};

}  // namespace unimapper::store::store_test
