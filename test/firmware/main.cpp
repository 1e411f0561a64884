// The host programs of src/firmware against fake controllers. Exit code 1 if something is wrong.
#include "fake.h"

void testAscon();
void testSlave();
void testMaster();
void testOrders();
void testPanel();
void testLog();
void testGateway();
void testRingNode();
void testCanPort();

int main() {
  testAscon();
  testSlave();
  testMaster();
  testOrders();
  testPanel();
  testLog();
  testGateway();
  testRingNode();
  testCanPort();
  std::printf("%d wrong\n", failures);
  return failures > 0;
}
