// The slave stack, and the gateway that is built on it, against fake controllers, under ASan and UBSan. Exit
// code 1 if something is wrong.
//   stack-test [MESSAGES [SEED]]: so many mutated mailbox messages
#include <cstdlib>

#include "controller.h"

void testDriver();
void testStates();
void testMailbox();
void testSdo();
void testInformation();
void testPdo();
void testFoe();
void testProcess();
void testBetween();
void testRingGateway();
void testMutated(unsigned messages, unsigned seed);

int main(int argc, char** argv) {
  const auto number = [&](int n, unsigned absent) {
    return argc > n ? static_cast<unsigned>(std::atoi(argv[n])) : absent;
  };
  const unsigned messages = number(1, 20000), seed = number(2, 1);
  for (bool byWrite : {false, true}) {
    Controller::newByWrite = byWrite;
    if (byWrite) std::printf("and acknowledged by write:\n");
    testDriver();
    testStates();
    testMailbox();
    testSdo();
    testInformation();
    testPdo();
    testFoe();
    testProcess();
    testBetween();
    testRingGateway();
    testMutated(byWrite ? messages / 2 : messages - messages / 2, seed);
  }
  std::printf("%d wrong\n", failures);
  return failures > 0;
}
