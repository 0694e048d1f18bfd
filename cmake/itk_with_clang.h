// Included before anything else where ITK is used with clang. Debian's ITK was configured with g++ alone, and the
// header it generated then refuses every other compiler; what it learns of g++ 12 holds for clang 14 too.
#pragma once
#pragma clang system_header
#pragma push_macro("__clang__")
#pragma push_macro("__GNUC__")
#pragma push_macro("__GNUC_MINOR__")
#undef __clang__
#undef __GNUC__
#undef __GNUC_MINOR__
#define __GNUC__ 12
#define __GNUC_MINOR__ 2
#include <itk_compiler_detection.h>
#pragma pop_macro("__GNUC_MINOR__")
#pragma pop_macro("__GNUC__")
#pragma pop_macro("__clang__")
