/* Shares, copies or marks PETSc objects */
#ifndef AINSWORTH_OBJECTS_H
#define AINSWORTH_OBJECTS_H

#include "petsccompat.h"
#include <memory>
#include <utility>

/* A reference to a PETSc object, given up together with the value that holds it; NULL if it holds none */
template <typename Object>
class AinsworthRef {
public:
  AinsworthRef() = default;
  AinsworthRef(const AinsworthRef &from) : object(from.object) { (void)PetscObjectReference((PetscObject)object); }
  AinsworthRef(AinsworthRef &&from) noexcept : object(from.object) { from.object = NULL; }
  ~AinsworthRef() { (void)PetscObjectDestroy((PetscObject *)&object); }
  AinsworthRef &operator=(AinsworthRef from) noexcept
  {
    std::swap(object, from.object);
    return *this;
  }
           operator Object() const { return object; }
  explicit operator PetscObject() const { return (PetscObject)object; }

  /* Gives up the object, and returns where a function puts a new one */
  Object *out()
  {
    (void)PetscObjectDestroy((PetscObject *)&object);
    return &object;
  }

  void reset() { (void)out(); }

private:
  Object object = NULL;
};

/* Holds an object with a reference of its own */
template <typename Object>
static inline AinsworthRef<Object> AinsworthRetain(Object object)
{
  AinsworthRef<Object> ref;

  (void)PetscObjectReference((PetscObject)object);
  *ref.out() = object;
  return ref;
}

/* Holds an object that the caller gives away */
template <typename Object>
static inline AinsworthRef<Object> AinsworthOwn(Object object)
{
  AinsworthRef<Object> ref;

  *ref.out() = object;
  return ref;
}

/* Sets *to = from and adds a reference; what *to pointed to before is not destroyed */
template <typename Object>
static inline PetscErrorCode AinsworthShare(Object from, Object *to)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)from));
  *to = from;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets *to = from (may be NULL), adds a reference and destroys what *to pointed to before */
template <typename Object>
static inline PetscErrorCode AinsworthReplace(Object from, Object *to)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)from));
  PetscCall(PetscObjectDestroy((PetscObject *)to));
  *to = from;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode AinsworthVecClone(Vec v, Vec *copy)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(v, copy));
  PetscCall(VecCopy(v, *copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells PETSc that an object has changed in a way that it does not see */
static inline PetscErrorCode AinsworthStateIncrease(PetscObject object)
{
  PetscObjectState state;

  PetscFunctionBegin;
  PetscCall(PetscObjectStateGet(object, &state));
  PetscCall(PetscObjectStateSet(object, state + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <typename Data>
static inline PetscErrorCode AinsworthDelete(AinsworthContext context)
{
  delete (Data *)AinsworthContextGet(context);
  return PETSC_SUCCESS;
}

/* Attaches data to an object, which deletes them in the end */
template <typename Data>
static inline PetscErrorCode AinsworthAttach(PetscObject object, const char name[], std::unique_ptr<Data> data)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PETSC_COMM_SELF, &container));
  PetscCall(PetscContainerSetPointer(container, data.release()));
  PetscCall(PetscContainerSetCtxDestroy(container, AinsworthDelete<Data>));
  PetscCall(PetscObjectCompose(object, name, (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets what AinsworthAttach() attached, NULL if nothing */
template <typename Data>
static inline PetscErrorCode AinsworthGetAttached(PetscObject object, const char name[], Data **data)
{
  PetscContainer container;

  PetscFunctionBegin;
  *data = NULL;
  PetscCall(PetscObjectQuery(object, name, (PetscObject *)&container));
  if (container) PetscCall(PetscContainerGetPointer(container, (void **)data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A value, and the state of the object that it belongs to */
template <typename Value>
struct AinsworthMemory {
  PetscObjectState state = 0;
  Value            value;
};

/* Keeps a value with an object until its state changes */
template <typename Value>
static inline PetscErrorCode AinsworthRemember(PetscObject object, const char name[], Value value)
{
  PetscObjectState state;

  PetscFunctionBegin;
  PetscCall(PetscObjectStateGet(object, &state));
  PetscCall(
    AinsworthAttach(object, name, std::make_unique<AinsworthMemory<Value>>(AinsworthMemory<Value>{state, value})));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the value of AinsworthRemember(), if there is one that still holds */
template <typename Value>
static inline PetscErrorCode AinsworthRecall(PetscObject object, const char name[], Value *value, PetscBool *known)
{
  PetscObjectState        state;
  AinsworthMemory<Value> *memory;

  PetscFunctionBegin;
  *known = PETSC_FALSE;
  PetscCall(PetscObjectStateGet(object, &state));
  PetscCall(AinsworthGetAttached(object, name, &memory));
  *known = (PetscBool)(memory && memory->state == state);
  if (*known) *value = memory->value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets entries at random between -1 and 1. Collective */
static inline PetscErrorCode AinsworthVecSetRandom(Vec v)
{
  PetscRandom random;

  PetscFunctionBegin;
  PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)v), &random));
  PetscCall(PetscRandomSetInterval(random, -1.0, 1.0));
  PetscCall(VecSetRandom(v, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
