/* The names of Java's native interface that Arm's samples use, to compile them as programs of their own: nothing calls Java. */
#pragma once

#include <stdint.h>

#define JNIEXPORT
#define JNICALL

typedef int32_t jint;
typedef struct fovea_java_object *jobject;
typedef jobject jclass, jstring;
typedef struct fovea_java_environment JNIEnv;
