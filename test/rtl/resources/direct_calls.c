/* Calls into simulations that chiseltest has built, for DirectSimulation.scala. */
#include <stdint.h>

/* JNI's calling convention, without its header: environment and object first, which nobody looks at. */
#define CALL(result, name, ...) result Java_flyframe_DirectCalls_##name(void *jni, void *self, __VA_ARGS__)

CALL(void, run, int64_t function, int64_t state) { ((void (*)(int64_t))function)(state); }

CALL(int64_t, step, int64_t function, int64_t state, int32_t cycles)
{
    return ((int64_t (*)(int64_t, int32_t))function)(state, cycles);
}

CALL(int64_t, peek, int64_t function, int64_t state, int32_t id)
{
    return ((int64_t (*)(int64_t, int32_t))function)(state, id);
}

CALL(void, poke, int64_t function, int64_t state, int32_t id, int64_t value)
{
    ((void (*)(int64_t, int32_t, int64_t))function)(state, id, value);
}

CALL(int64_t, peekWide, int64_t function, int64_t state, int32_t id, int32_t word)
{
    return ((int64_t (*)(int64_t, int32_t, int32_t))function)(state, id, word);
}

CALL(void, pokeWide, int64_t function, int64_t state, int32_t id, int32_t word, int64_t value)
{
    ((void (*)(int64_t, int32_t, int32_t, int64_t))function)(state, id, word, value);
}
