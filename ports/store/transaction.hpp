// Transactions that are rolled back unless they are committed.
#pragma once

#include "ports/store/database.hpp"

namespace unimapper::store {

/// A change of the database, whole or not at all.
class Transaction {
 public:
  explicit Transaction(Database& database) : database_(database) {
    database_.run("BEGIN IMMEDIATE");
  }
  ~Transaction() {
    if (!database_.is_in_transaction()) return;
    try {
      database_.run("ROLLBACK");
    } catch (const StoreError&) {
      // SQLite rolls back by itself before the next transaction.
    }
  }
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// Returns once the disk has it. Throws StoreError; nothing is changed then.
  void commit() { database_.run("COMMIT"); }

 private:
  Database& database_;
};

/// One state of the database for several statements, whatever others commit meanwhile. Within
/// another snapshot or a transaction it is part of that.
class Snapshot {
 public:
  explicit Snapshot(Database& database)
      : database_(database), is_own_(!database.is_in_transaction()) {
    if (is_own_) database_.run("BEGIN");
  }
  ~Snapshot() {
    if (!is_own_) return;
    try {
      database_.run("COMMIT");
    } catch (const StoreError&) {
      // Nothing was written; closing the connection ends it too.
    }
  }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;

 private:
  Database& database_;
  bool is_own_;
};

}  // namespace unimapper::store
