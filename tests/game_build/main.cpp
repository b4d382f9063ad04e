#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>

#include <cstdio>

// Links, and answers what every game must expect: that there is no such pack.
int main() {
    const auto pack = dimmer::Pack::open("no such pack.dimmer");
    if (pack) return 1;
    std::printf("%s\n", pack.error().message.c_str());
    return pack.error().code == dimmer::ErrorCode::Io ? 0 : 1;
}
