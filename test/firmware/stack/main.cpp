// The slave stack against a fake controller, under ASan and UBSan. Exit code 1 if something is wrong.
//   stack-test [MESSAGES [SEED]]: so many mutated mailbox messages
#include <cstdlib>

#include "../fake.h"

void testDriver();
void testStates();
void testMailbox();
void testSdo();
void testInformation();
void testPdo();
void testFoe();
void testProcess();
void testMutated(unsigned messages, unsigned seed);

int main(int argc, char** argv) {
  testDriver();
  testStates();
  testMailbox();
  testSdo();
  testInformation();
  testPdo();
  testFoe();
  testProcess();
  testMutated(argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 20000,
              argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
  std::printf("%d wrong\n", failures);
  return failures > 0;
}
