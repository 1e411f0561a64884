package flyframe.server

/** What a master or a ring's gateway has sent, as far as it decides whether it counts. */
trait Sent {

  /** Of who has sent it; life of the server, as far as he knows, or 0. */
  def life: Life
  def server: Long

  /** Of what he has sent in this life, from 1 on. */
  def counter: Long

  /** Numbers of its first event or part, and behind its last one. */
  def first: Long
  def end: Long
}
