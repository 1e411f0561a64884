// The host programs of src/firmware against fake controllers. Exit code 1 if something is wrong.
#include "fake.h"

void testSlave();
void testMaster();

int main() {
  testSlave();
  testMaster();
  std::printf("%d wrong\n", failures);
  return failures > 0;
}
