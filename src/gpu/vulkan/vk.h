/* The Vulkan backend's own structs; private to src/gpu/vulkan. */
#ifndef SPL_GPU_VULKAN_VK_H
#define SPL_GPU_VULKAN_VK_H

#include <vulkan/vulkan.h>

#include "base/clock.h"
#include "gpu/backend.h"

struct vk_list {
    VkCommandPool pool;
    VkCommandBuffer commands;
    VkQueryPool queries;
    uint32_t written;              /* bit per timestamp slot */
};

struct vk_gpu {
    struct spl_gpu base;           /* first */
    VkInstance instance;           // its own; NULL = not opened
    VkPhysicalDevice physical;
    VkPhysicalDeviceMemoryProperties memory;
    VkDevice device;
    VkQueue queue;
    uint32_t family;
    VkPipelineCache cache;
    char cache_path[4096];         /* "" = none */
    size_t cache_loaded;           /* bytes that came from disk */
    VkSemaphore timeline;          /* its value is the last ended ticket */
    struct vk_list list;           /* being recorded, or running */
    double timestamp_period_ns;
    uint64_t timestamp_mask;
    PFN_vkCmdPushDescriptorSetKHR push_descriptors;
};

struct vk_buffer {
    struct spl_gpu_buffer base;    /* first */
    VkBuffer buffer;
    VkBufferView texels;           /* its words; none where the buffer is larger than a binding */
    VkDeviceMemory memory;
};

struct vk_kernel {
    struct spl_gpu_kernel base;    /* first */
    VkDescriptorSetLayout set_layout;
    VkPipelineLayout layout;
    VkPipeline pipeline;
};

/* instance.c. Kept for the life of the process. get() borrows any, for who looks at devices; take() one that no other
 * open device has, as far as there are enough, until give_back(); with `debug` it carries the validation layer where
 * that is installed. */
int vk_instance_get(VkInstance *out, struct spl_error *err);
int vk_instance_take(bool debug, VkInstance *out, struct spl_error *err);
void vk_instance_give_back(VkInstance instance); /* NULL-safe */

/* list.c. Fills `err` with `what` and the name of `result`; the code is SPL_E_DEVICE_LOST for a lost device, else
 * `code`. */
int vk_fail(struct spl_error *err, int code, VkResult result, const char *what);
/* The index-th device, judged; `family` may be NULL. False past the end. */
bool vk_device_get(VkInstance instance, uint32_t index, VkPhysicalDevice *out, struct spl_device_info *info,
                   uint32_t *family);
size_t vk_list(struct spl_device_info *devices, size_t capacity);

/* buffer.c */
int vk_buffer_create(struct spl_gpu *gpu, enum spl_gpu_buffer_kind kind, uint64_t bytes, struct spl_gpu_buffer **out,
                     struct spl_error *err);
void vk_buffer_destroy(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer);

/* kernel.c */
int vk_kernel_create(struct spl_gpu *gpu, const struct spl_gpu_code *code, const uint32_t *constants,
                     size_t constant_count, struct spl_gpu_kernel **out, struct spl_error *err);
void vk_kernel_destroy(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel);
int vk_cache_load(struct vk_gpu *gpu, const VkPhysicalDeviceProperties *properties, const char *folder,
                  struct spl_error *err);
void vk_cache_save(struct vk_gpu *gpu);

/* frame.c */
int vk_frames_init(struct vk_gpu *gpu, struct spl_error *err);
void vk_frames_finish(struct vk_gpu *gpu);
int vk_begin(struct spl_gpu *gpu, struct spl_error *err);
void vk_dispatch(struct spl_gpu *gpu, struct spl_gpu_kernel *kernel, const struct spl_gpu_arguments *arguments,
                 uint32_t workgroups);
void vk_barrier(struct spl_gpu *gpu);
void vk_copy(struct spl_gpu *gpu, struct spl_gpu_buffer *from, uint64_t from_offset, struct spl_gpu_buffer *to,
             uint64_t to_offset, uint64_t bytes);
void vk_fill(struct spl_gpu *gpu, struct spl_gpu_buffer *buffer, uint64_t offset, uint64_t bytes, uint32_t word);
void vk_timestamp(struct spl_gpu *gpu, uint32_t slot);
int vk_submit(struct spl_gpu *gpu, uint64_t ticket, struct spl_error *err);
int vk_wait(struct spl_gpu *gpu, uint64_t ticket, uint64_t timeout_ns, struct spl_error *err);
void vk_read_timestamps(struct spl_gpu *gpu);

#endif
