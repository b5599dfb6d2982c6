typedef void (*TaskFunction_t)(void *);
typedef void *TaskHandle_t;

TickType_t xTaskGetTickCount(void);
BaseType_t xTaskCreate(TaskFunction_t task, const char *name, uint32_t stack_bytes, void *argument,
                       UBaseType_t priority, TaskHandle_t *created);
