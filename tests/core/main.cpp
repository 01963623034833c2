#if ISOSPLINE_CATCH2_VERSION_MAJOR < 3
#define CATCH_CONFIG_MAIN
#endif
#include "catch.h"

#if ISOSPLINE_CATCH2_VERSION_MAJOR >= 3
int main(int argc, char** argv)
{
    return Catch::Session().run(argc, argv);
}
#endif
