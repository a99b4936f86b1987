/* The texts that libjpeg-turbo prints. */
#pragma once

#define JCOPYRIGHT ""
#define JCOPYRIGHT_SHORT ""
#define JVERSION "6b"
