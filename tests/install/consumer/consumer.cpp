#if __has_include(<blockid/data/error.hpp>)
#include <blockid/data/error.hpp>
#endif

int main() { return 0; }
