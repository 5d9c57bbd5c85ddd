/* A page whose name's owner lets it point at this machine is, to a browser, of the same origin as we are (DNS
 * rebinding). Its requests still carry its name in Host. Nobody can own an address or localhost, so these are ours
 * without a word; any other name has to be listed. Only what a browser writes is read: it turns 127.1 and 0x7f.1 into
 * 127.0.0.1 itself. */
#include "service/access/host.h"

#include <arpa/inet.h>
#include <string.h>
#include <strings.h>

enum { name_max = 253 };

/* uri-host [":" port] of RFC 9110 section 7.2: the host, without brackets and its last dot; false for anything else. */
static bool split(const char *text, char name[name_max + 3], bool *address)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-_";
    struct in6_addr six;
    bool bracket = *text == '[';
    size_t length = bracket ? strcspn(text + 1, "]") : strspn(text, letters);
    const char *rest = text + length;
    if (bracket) {
        if (text[length + 1] != ']')
            return false;
        rest += 2;
        text++;
    }
    if (!length || length > name_max + 1 || (*rest && (*rest != ':' || rest[1 + strspn(rest + 1, "0123456789")])))
        return false;
    memcpy(name, text, length);
    name[length] = '\0';
    if (bracket)
        return *address = inet_pton(AF_INET6, name, &six) == 1;
    if (name[length - 1] == '.')
        name[--length] = '\0';
    *address = inet_pton(AF_INET, name, &six) == 1;
    return length && length <= name_max && name[length - 1] != '.';
}

static bool is_among(const struct spl_text_list *names, const char *name)
{
    char listed[name_max + 3];
    bool address;
    for (size_t i = 0; i < names->count; i++)
        if (split(names->items[i], listed, &address) && !strcasecmp(listed, name))
            return true;
    return false;
}

bool spl_host_is_name(const char *text)
{
    char name[name_max + 3];
    bool address;
    return split(text, name, &address) && (*text == '[' || !strchr(text, ':')) &&
           (*text != '[' || text[strlen(text) - 1] == ']');
}

bool spl_host_is_ours(const char *host, const struct spl_text_list *names)
{
    char name[name_max + 3];
    bool address;
    if (!split(host, name, &address))
        return false;
    if (address || !strcasecmp(name, "localhost") || is_among(names, name))
        return true;
    for (size_t i = 0; i < names->count; i++)
        if (!strcmp(names->items[i], "*"))
            return true;
    return false;
}

bool spl_origin_is_ours(const char *origin, const char *host, const struct spl_text_list *names)
{
    char name[name_max + 3];
    bool address;
    const char *authority = strstr(origin, "://");
    if (!authority || !split(authority += 3, name, &address))
        return false;
    return (host && !strcasecmp(authority, host)) || is_among(names, name);
}
